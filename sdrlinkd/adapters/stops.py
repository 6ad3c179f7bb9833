"""Messages that are handed over when a command topic falls silent."""

import difflib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from sdrlinkd.adapters.typestore import empty, knows, to_cdr
from sdrlinkd.config import Setup
from sdrlinkd.errors import ConfigError, UserError


def stop_messages(setup: Setup) -> dict[int, bytes]:
    """CDR by topic id, of topics whose type is known; as their policy's `stop` says, else zero.

    Raises ConfigError where a policy asks for what cannot be made.
    """
    made = {}
    for topic in setup.registry.topics:
        policy = setup.policies.get(topic.id)
        given = policy.stop if policy is not None else {}
        where = f"{setup.source}: topic.{topic.name}"
        if not knows(topic.type):
            if policy is not None and (policy.deadman_s or given):
                raise ConfigError(
                    f"{where}.deadman_s: got {policy.deadman_s:g}, but the type {topic.type} is "
                    "not known here, so no stop message can be made; allowed: 0"
                )
            continue
        made[topic.id] = to_cdr(_filled(empty(topic.type), given, f"{where}.stop"), topic.type)
    return made


def header_topics(setup: Setup) -> frozenset[int]:
    """Topics whose messages begin with a std_msgs/Header."""
    known = (topic for topic in setup.registry.topics if knows(topic.type))
    return frozenset(topic.id for topic in known if _begins_with_header(empty(topic.type)))


def _begins_with_header(message: Any) -> bool:  # noqa: ANN401
    first = next(iter(fields(message)), None)
    name = type(getattr(message, first.name)).__name__ if first else ""
    return name == "std_msgs__msg__Header"


def _filled(message: Any, given: Mapping[str, Any], where: str) -> Any:  # noqa: ANN401
    """`message` with the fields of `given`, for error messages called `where`."""
    names = [field.name for field in fields(message) if not field.name.startswith("__")]
    for name, value in given.items():
        if name not in names:
            near = difflib.get_close_matches(name, names, 1)
            hint = f" (did you mean {near[0]}?)" if near else ""
            raise ConfigError(f"{where}.{name}: no such field{hint}; allowed: {', '.join(names)}")
        old = getattr(message, name)
        try:
            object.__setattr__(message, name, _value(old, value, f"{where}.{name}"))
        except (TypeError, ValueError) as error:
            raise ConfigError(f"{where}.{name}: got {value!r}; {error}") from None
    return message


def _value(old: Any, given: Any, where: str) -> Any:  # noqa: ANN401
    if is_dataclass(old):
        if not isinstance(given, Mapping):
            raise UserError(f"{where}: got {given!r}; allowed: a table of its fields")
        return _filled(old, given, where)
    if isinstance(old, np.ndarray):
        return np.asarray(given, old.dtype)
    if isinstance(old, bool) != isinstance(given, bool):
        raise UserError(f"{where}: got {given!r}; allowed: a {type(old).__name__}")
    if isinstance(old, str) != isinstance(given, str):
        raise UserError(f"{where}: got {given!r}; allowed: a {type(old).__name__}")
    return type(old)(given)
