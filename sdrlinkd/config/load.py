"""Reads TOML into `Config`; errors cite file, line and key, and what was given and is allowed."""

import re
import tomllib
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from msgspec import inspect

from sdrlinkd.config import describe, quantities
from sdrlinkd.config.backends import config_type
from sdrlinkd.config.places import KeyPath, cite
from sdrlinkd.config.schema import Config
from sdrlinkd.errors import ConfigError
from sdrlinkd.files import read_bounded
from sdrlinkd.link import TopicPolicy

S = TypeVar("S", bound=msgspec.Struct)

_PLACE = re.compile(r" \(at (?:line (\d+)(, column \d+)|end of document)\)")
_CURLY = re.compile("[\u2018-\u201f\u00ab\u00bb]")
_YAML = re.compile(r"\s*([\w.-]+):(\s|$)")
_AT = re.compile(r" - at `\$\.?(.*)`$")


def load_config(path: Path) -> Config:
    """The configuration in `path`. Raises ConfigError."""
    try:
        # An editor may have put a byte order mark before the text.
        text = read_bounded(path).decode("utf-8-sig")
    except OSError as error:
        raise ConfigError(
            f"{path}: cannot be read ({error.strerror}); name a configuration with --config FILE"
        ) from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is not a text in UTF-8; save it as one") from None
    return parse_config(text, str(path))


def parse_config(text: str, source: str = "config") -> Config:
    """The configuration in TOML `text`. Raises ConfigError that cites `source`."""
    raw = _read(text, source)
    try:
        kind = config_type(raw)
    except ConfigError as error:
        told = str(error).removeprefix("backend")
        raise ConfigError(cite(source, text, ["backend"]) + told) from None
    return _typed(raw, text, source, kind)


def parse_toml(text: str, source: str, kind: type[S]) -> S:
    """TOML `text` as a struct of type `kind`. Raises ConfigError that cites `source` and key."""
    return _typed(_read(text, source), text, source, kind)


def _read(text: str, source: str) -> dict[str, object]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(_not_toml(text, source, str(error))) from None


def _not_toml(text: str, source: str, problem: str) -> str:
    """What is wrong with a text that is not TOML, where, and what may have been meant."""
    found, lines = _PLACE.search(problem), text.splitlines()
    number = int(found[1]) if found and found[1] else len(lines)
    at = f":{number}" if found else ""
    line = lines[number - 1] if found and 0 < number <= len(lines) else ""
    if text.lstrip().startswith("{"):
        hint = 'this looks like JSON; write TOML, such as namespace = "robot_1"'
    elif curly := _CURLY.search(line):
        hint = f'{curly[0]} is a typographic quote; write "'
    elif yaml := _YAML.match(line):
        hint = f'this looks like YAML; write {yaml[1]} = …, with texts in "…"'
    elif problem.startswith("Invalid value"):
        hint = 'texts stand in quotes, as in namespace = "robot_1"'
    else:
        hint = ""
    told = _PLACE.sub(lambda place: place[2] or "", problem)
    return f"{source}{at}: not TOML: {told}" + (f"; {hint}" if hint else "")


def _typed(raw: dict[str, object], text: str, source: str, kind: type[S]) -> S:
    _refuse_unknown(raw, describe.type_of(kind), [], text, source)
    try:
        typed = msgspec.convert(quantities.as_numbers(raw, describe.type_of(kind)), kind)
    except msgspec.ValidationError as error:
        raise _explain(error, raw, text, source, describe.type_of(kind)) from None
    _note_given(typed, raw)
    return typed


def _note_given(typed: msgspec.Struct, raw: Mapping[str, Any]) -> None:
    """Note in each policy which keys `raw` gives, as absent ones may come from elsewhere."""
    for section in typed.__struct_fields__:
        policies = getattr(typed, section)
        if isinstance(policies, dict):
            for name, policy in policies.items():
                if isinstance(policy, TopicPolicy):
                    policies[name] = policy.given_in(raw[section][name])


def explain_policy(changes: Mapping[str, object]) -> str:
    """The error text for `changes` to a topic's policy: which key is wrong, and what is allowed."""
    kind = describe.type_of(TopicPolicy)
    for key, value in changes.items():
        inner = describe.child(kind, key)
        try:
            msgspec.convert({key: value}, TopicPolicy)
        except msgspec.ValidationError:
            what = describe.allowed(inner) if inner is not None else "no such key"
            return f"{key}: got {describe.given(value)}; allowed: {what}"
    return f"{', '.join(changes)}: not allowed together"


def _refuse_unknown(
    table: dict[str, object], kind: inspect.Type, path: KeyPath, text: str, source: str
) -> None:
    known = describe.keys_of(kind)
    for key, value in table.items():
        here = [*path, key]
        if known is not None and key not in known:
            close = get_close_matches(key, known, n=1)
            hint = f"did you mean {close[0]}? " if close else ""
            raise ConfigError(
                f"{cite(source, text, here)}: unknown key; {hint}allowed: {', '.join(known)}"
            )
        inner = describe.child(kind, key)
        if isinstance(value, dict) and inner is not None:
            _refuse_unknown(value, inner, here, text, source)
        elif isinstance(value, list) and isinstance(inner, inspect.ListType):
            for i, each in enumerate(value):
                if isinstance(each, dict):
                    _refuse_unknown(each, inner.item_type, [*here, i], text, source)


def _explain(
    error: msgspec.ValidationError,
    raw: dict[str, object],
    text: str,
    source: str,
    kind: inspect.Type | None,
) -> ConfigError:
    found = _AT.search(str(error))
    # msgspec writes `[...]` for the values of a dict, `[3]` for those of a list.
    path = re.findall(r"[^.\[\]]+", found[1].replace("[...]", ".*")) if found else []
    value: object = raw
    named: KeyPath = []
    for step in path:
        if isinstance(value, list):
            index = int(step) if step.isdigit() else 0
            value = value[index]
            named.append(index)
            kind = kind.item_type if isinstance(kind, inspect.ListType) else None
        elif isinstance(value, dict):
            key = _first_bad_key(value, kind) if step == "*" else step
            named.append(key)
            value = value.get(key)
            kind = describe.child(kind, key) if kind is not None else None
    missing = re.search(r"missing required field `(.*)`", str(error).split(" - at ")[0])
    if missing:
        named.append(missing[1])
        inner = describe.child(kind, missing[1]) if kind is not None else None
        what = describe.allowed(inner) if inner is not None else "a value"
        where = cite(source, text, named[:-1] or named)
        return ConfigError(f"{where}: has no {missing[1]}; allowed: {what}")
    what = describe.allowed(kind) if kind is not None else str(error)
    if kind is not None and named:
        what += quantities.example(named[-1], kind)
    return ConfigError(f"{cite(source, text, named)}: got {describe.given(value)}; allowed: {what}")


def _first_bad_key(table: dict[str, object], kind: inspect.Type | None) -> str:
    """The first key in `table` whose value does not convert."""
    struct = kind.value_type if isinstance(kind, inspect.DictType) else None
    for key, value in table.items():
        try:
            if isinstance(struct, inspect.StructType):
                msgspec.convert(value, struct.cls)
        except msgspec.ValidationError:
            return key
    return "*"
