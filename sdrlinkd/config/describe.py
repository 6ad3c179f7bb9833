"""Describes in words which values a key allows, from its type."""

import math

import msgspec
from msgspec import inspect


def allowed(kind: inspect.Type) -> str:
    """What a key of `kind` may hold, for errors: `a whole number from 32 to 2047`, `text`, …"""
    if isinstance(kind, inspect.IntType):
        return "a whole number" + _range(kind.ge, kind.gt, kind.le, kind.lt)
    if isinstance(kind, inspect.FloatType):
        return "a number" + _range(kind.ge, kind.gt, kind.le, kind.lt)
    if isinstance(kind, inspect.BoolType):
        return "true or false"
    if isinstance(kind, inspect.StrType):
        return 'text in "quotes"'
    if isinstance(kind, inspect.LiteralType):
        if len(kind.values) == 1:
            return f'"{kind.values[0]}"'
        return "one of " + ", ".join(f'"{value}"' for value in kind.values)
    if isinstance(kind, inspect.ListType):
        few, most = kind.min_length, kind.max_length
        length = ""
        if few is not None and few == most:
            length = f" of {few}"
        elif few is not None:
            length = f" of at least {few}" + (f" and at most {most}" if most is not None else "")
        return f"a list{length}, each of it {allowed(kind.item_type)}"
    if is_table(kind):
        return "a table"
    if isinstance(kind, inspect.UnionType):
        # Literal words first, as they are the likelier choice.
        types = sorted(kind.types, key=lambda each: not isinstance(each, inspect.LiteralType))
        return " or ".join(
            allowed(each) for each in types if not isinstance(each, inspect.NoneType)
        )
    return str(kind)


def given(value: object) -> str:
    """A value as text that a person recognises."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return str(value)


def keys_of(kind: inspect.Type) -> list[str] | None:
    """The keys that a table of `kind` may have; None if any key is allowed."""
    return (
        [field.encode_name for field in kind.fields]
        if isinstance(kind, inspect.StructType)
        else None
    )


def is_table(kind: inspect.Type) -> bool:
    """Whether a value of `kind` is a table."""
    return isinstance(kind, inspect.StructType | inspect.DictType)


def child(kind: inspect.Type, key: str) -> inspect.Type | None:
    """The type of `key` in a table of `kind`; None if there is no such key."""
    if isinstance(kind, inspect.StructType):
        return next((field.type for field in kind.fields if field.encode_name == key), None)
    if isinstance(kind, inspect.DictType):
        return kind.value_type
    return None


def type_of(struct: type[msgspec.Struct]) -> inspect.Type:
    """The inspectable type of a struct."""
    return inspect.type_info(struct)


def _range(ge: float | None, gt: float | None, le: float | None, lt: float | None) -> str:
    if ge is not None and le is not None:
        return f" from {ge} to {le}"
    bounds = [
        f"{word} {bound}"
        for word, bound in (("at least", ge), ("above", gt), ("at most", le), ("below", lt))
        if bound is not None
    ]
    return " " + " and ".join(bounds) if bounds else ""
