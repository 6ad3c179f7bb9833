"""The keys of the configuration, from its schema: purpose, allowed values, default."""

from dataclasses import dataclass

import msgspec
from msgspec import inspect

from sdrlinkd.config import Config, allowed_text, given_text, unit_example
from sdrlinkd.manual.attributes import field_texts, summary_of


@dataclass(frozen=True)
class Key:
    """One key of the configuration."""

    path: str
    """As errors cite it: `link.pdu_size`."""
    text: str
    """What it is for."""
    allowed: str
    """What it takes, in words."""
    default: str
    """As TOML has it; empty: the key is absent."""


@dataclass(frozen=True)
class Section:
    """A table of the configuration, or the keys above all tables."""

    name: str
    """As in its TOML header; empty: the keys above all tables."""
    text: str
    keys: tuple[Key, ...]


def sections() -> list[Section]:
    """All of the configuration, in the order of the schema."""
    return list(_sections(inspect.type_info(Config), ""))


def key_names() -> list[str]:
    """The paths of all keys."""
    return [key.path for section in sections() for key in section.keys]


def find_key(path: str) -> Key | None:
    """The key of that path, or, without its section, the only one of that name."""
    keys = [key for section in sections() for key in section.keys]
    exact = [key for key in keys if key.path == path]
    close = exact or [key for key in keys if key.path.rpartition(".")[2] == path]
    return close[0] if len(close) == 1 else None


def _sections(kind: inspect.Type, name: str) -> "list[Section]":
    if not isinstance(kind, inspect.StructType):
        raise TypeError(f"{name}: no struct but {kind}")
    texts = field_texts(kind.cls)
    keys, below = [], []
    for field in kind.fields:
        path = f"{name}.{field.encode_name}" if name else field.encode_name
        table = _table(field.type)
        if isinstance(field.type, inspect.DictType) and table:
            below += _sections(table, f"{path}.NAME")
        elif table:
            below += _sections(table, path)
        else:
            keys.append(_key(path, field, texts.get(field.name, "")))
    return [Section(name, summary_of(kind.cls), tuple(keys)), *below]


def _table(kind: inspect.Type) -> inspect.StructType | None:
    """The struct that is a table of its own, if `kind` is one or a table of them by name."""
    if isinstance(kind, inspect.DictType):
        kind = kind.value_type
    return kind if isinstance(kind, inspect.StructType) else None


def _key(path: str, field: inspect.Field, text: str) -> Key:
    name = path.rpartition(".")[2]
    default = field.default
    if field.default_factory is not msgspec.NODEFAULT:
        default = field.default_factory()
    shown = "" if default is None or default is msgspec.NODEFAULT else _toml(default)
    return Key(path, text, allowed_text(field.type) + unit_example(name, field.type), shown)


def _toml(value: object) -> str:
    if isinstance(value, dict):
        return "{}" if not value else "{ … }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(given_text(each) for each in value) + "]"
    return given_text(value)
