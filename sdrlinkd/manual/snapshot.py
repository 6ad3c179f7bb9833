"""The reference page of the snapshot that `status --json` prints."""

import msgspec
from msgspec import inspect

from sdrlinkd.manual.attributes import field_texts, summary_of
from sdrlinkd.reports import Snapshot

INTRODUCTION = """\
# Snapshot fields

`sdrlinkctl status --json` prints one snapshot of a daemon. `--field PATH` prints one value of it,
`--field PATH --csv` a line for a table. In a path, a topic or robot is named by its name or id:
`link.topics.odom.sent`, `link.neighbors.2.snr_db`; `link.` may be left out. Units are in the names;
counters only grow; `*_per_s` are means over the last 5 s. `null` means unknown.
"""


def snapshot_page() -> str:
    """The page in Markdown: a section for each part, an entry for each field."""
    done: set[type[msgspec.Struct]] = set()
    parts: list[str] = [INTRODUCTION]
    waiting = [("", inspect.type_info(Snapshot))]
    while waiting:
        path, kind = waiting.pop(0)
        if not isinstance(kind, inspect.StructType) or kind.cls in done:
            continue
        done.add(kind.cls)
        title = f"`{path}`" if path else "At the top"
        parts.append(f"## {title}\n\n{summary_of(kind.cls)}\n")
        texts = field_texts(kind.cls)
        for field in kind.fields:
            below, suffix = _struct_in(field.type)
            own = f"{path}.{field.encode_name}" if path else field.encode_name
            if below is not None:
                waiting.append((own + suffix, below))
            text = texts.get(field.name) or (summary_of(below.cls) if below else "")
            parts.append(f"`{own}`\n:   {text} ({_kind(field.type)})\n")
    return "\n".join(parts)


def _struct_in(kind: inspect.Type) -> tuple[inspect.StructType | None, str]:
    """The struct that a field holds, and how a path goes on to it."""
    if isinstance(kind, inspect.StructType):
        return kind, ""
    if isinstance(kind, inspect.ListType):
        return _struct_in(kind.item_type)[0], ".N"
    if isinstance(kind, inspect.DictType):
        return _struct_in(kind.value_type)[0], ".NAME"
    if isinstance(kind, inspect.UnionType):
        found = [_struct_in(each) for each in kind.types]
        return next((each for each in found if each[0] is not None), (None, ""))
    return None, ""


_PLAIN = {
    inspect.IntType: "integer",
    inspect.FloatType: "number",
    inspect.BoolType: "true or false",
    inspect.StrType: "text",
    inspect.NoneType: "null",
}


def _kind(kind: inspect.Type) -> str:
    if isinstance(kind, inspect.Metadata):
        return f"{_kind(kind.type)}, only grows"
    if type(kind) in _PLAIN:
        return _PLAIN[type(kind)]
    if isinstance(kind, inspect.ListType):
        return f"list of {_kind(kind.item_type)}"
    if isinstance(kind, inspect.DictType):
        return f"{_kind(kind.value_type)} by name"
    if isinstance(kind, inspect.LiteralType):
        return " | ".join(str(each) for each in kind.values)
    if isinstance(kind, inspect.UnionType):
        return " or ".join(_kind(each) for each in kind.types)
    return "fields of its own"
