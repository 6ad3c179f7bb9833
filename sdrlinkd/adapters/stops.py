"""Messages that are handed over when a command topic falls silent."""

import difflib
import struct
from collections.abc import Mapping
from typing import Any

from rosbags.interfaces import Nodetype

from sdrlinkd.adapters.typestore import empty, knows, ros2_types, to_cdr
from sdrlinkd.config import Setup
from sdrlinkd.errors import ConfigError

HEADER = "std_msgs/msg/Header"


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
        made[topic.id] = _made(topic.type, given, f"{where}.stop")
    return made


def _made(kind: str, given: Mapping[str, Any], where: str) -> bytes:
    try:
        return to_cdr(_filled(empty(kind), given, where), kind)
    except (struct.error, ValueError, OverflowError) as error:
        raise ConfigError(f"{where}: got {dict(given)!r}; {error}") from None


def header_topics(setup: Setup) -> frozenset[int]:
    """Topics whose messages begin with a std_msgs/Header."""
    known = (topic for topic in setup.registry.topics if knows(topic.type))
    return frozenset(topic.id for topic in known if _begins_with_header(topic.type))


def _begins_with_header(kind: str) -> bool:
    fields = ros2_types().fielddefs[kind][1]
    return bool(fields) and fields[0][1] == (Nodetype.NAME, HEADER)


def _filled(message: Any, given: Mapping[str, Any], where: str) -> Any:  # noqa: ANN401
    """`message` with the fields of `given`, for error messages called `where`."""
    kinds = dict(ros2_types().fielddefs[message.__msgtype__][1])
    for name, value in given.items():
        if name not in kinds:
            near = difflib.get_close_matches(name, kinds, 1)
            hint = f" (did you mean {near[0]}?)" if near else ""
            raise ConfigError(f"{where}.{name}: no such field{hint}; allowed: {', '.join(kinds)}")
        made = _value(getattr(message, name), kinds[name], value, f"{where}.{name}")
        object.__setattr__(message, name, made)
    return message


def _value(old: Any, kind: Any, given: Any, where: str) -> Any:  # noqa: ANN401
    """`given` as a field of that kind, which is `old` so far."""
    node, inner = kind
    if node == Nodetype.NAME:
        if not isinstance(given, Mapping):
            raise ConfigError(f"{where}: got {given!r}; allowed: a table of its fields")
        return _filled(old, given, where)
    if node != Nodetype.BASE:
        raise ConfigError(f"{where}: got {given!r}; arrays stay as they are")
    name = inner[0]
    wanted: tuple[type, ...] = (int,)
    if name in ("string", "wstring"):
        wanted = (str,)
    elif name == "bool":
        wanted = (bool,)
    elif name.startswith("float"):
        wanted = (int, float)
    if not isinstance(given, wanted) or isinstance(given, bool) != (name == "bool"):
        raise ConfigError(f"{where}: got {given!r}; allowed: a {name}")
    return float(given) if isinstance(given, int) and float in wanted else given
