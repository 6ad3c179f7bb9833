"""JSON schemas of reports, as Foxglove reads them, over a network and in MCAP files."""

from typing import Any

import msgspec
from msgspec import inspect

_PLAIN = (
    (inspect.BoolType, "boolean"),
    (inspect.IntType, "integer"),
    (inspect.FloatType, "number"),
    (inspect.StrType, "string"),
)


def json_schema(report: type[msgspec.Struct]) -> dict[str, Any]:
    """The schema of a report.

    Foxglove knows neither references nor alternatives: an optional field has the type of its value,
    and fields that it cannot describe, which are lists of lists, are left out. It shows them all
    the same.
    """
    return {"title": f"sdrlinkd.{report.__name__}", **(_of(inspect.type_info(report)) or {})}


def _of(kind: inspect.Type) -> dict[str, Any] | None:
    """The schema of a type; None if Foxglove cannot describe it."""
    if isinstance(kind, inspect.UnionType):
        kind = next(each for each in kind.types if not isinstance(each, inspect.NoneType))
    if isinstance(kind, inspect.Metadata):
        kind = kind.type
    if isinstance(kind, inspect.StructType):
        fields = {each.encode_name: _of(each.type) for each in kind.fields}
        known = {name: each for name, each in fields.items() if each is not None}
        return {"type": "object", "properties": known}
    if isinstance(kind, inspect.DictType):
        return {"type": "object", "properties": {}}
    if isinstance(kind, inspect.ListType):
        items = _of(kind.item_type)
        is_described = items is not None and items["type"] != "array"
        return {"type": "array", "items": items} if is_described else None
    for plain, name in _PLAIN:
        if isinstance(kind, plain):
            return {"type": name}
    return None
