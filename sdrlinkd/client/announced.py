"""Which messages the daemon accepts, as it announces (bus document, section 4.1), and the errors.

The daemon refuses messages with the same error texts; they are defined only here.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from sdrlinkd.client.errors import UNKNOWN_TOPIC, MessageRefusedError

QOS = ("bulk", "default", "latency", "urgent")
MAX_PRIORITY = 127
LEAST_RATE_HZ, MOST_RATE_HZ = 0.02, 1000.0
"""Rates in Hz that a consumer can ask for."""
BROADCAST = 255
CDR_HEADER_SIZE = 4
MAX_KEY_BYTES = 32
"""Longest producer key in octets of UTF-8."""
MOST_NAMES = 20
"""Most topic names that an error text lists."""


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic that the daemon accepts.

    `type` is its ROS message type, `most` the size of the largest message in octets, `key` the
    setting that limits the size, and `over` the ledger's reason for dropping a larger message.
    """

    type: str
    most: int
    key: str
    over: str


class Announced:
    """A daemon's announcement of the topics it accepts; `boot` changes with each of its starts."""

    def __init__(self, fields: Mapping[str, Any]) -> None:
        self.boot: str = fields.get("boot", "")
        self.topics = {
            name: Topic(each["ty"], each["most"], each["key"], each["over"])
            for name, each in fields["takes"].items()
        }
        self.most = {name: topic.most for name, topic in self.topics.items()}
        self.types = {name: topic.type for name, topic in self.topics.items()}
        self.frames = {name: name.encode() + b"\0" for name in self.topics}

    def check(self, name: str, size: int, type_: str | None) -> None:
        """Raise MessageRefusedError if the daemon refuses `size` octets of `type_` for `name`."""
        topic = self.topics.get(name)
        if topic is None:
            raise MessageRefusedError(UNKNOWN_TOPIC, unknown_topic(name, self.topics))
        if size < CDR_HEADER_SIZE:
            raise MessageRefusedError("tx_bad_envelope", too_short(name, size))
        if size > topic.most:
            raise MessageRefusedError(topic.over, too_large(name, size, topic.most, topic.key))
        if type_ is not None and type_ != topic.type:
            raise MessageRefusedError("tx_bad_envelope", wrong_type(name, type_, topic.type))


def check_wishes(
    qos: object = None,
    priority: object = None,
    dst: object = None,
    lifespan_ms: object = None,
    published_ns: object = None,
    key: object = None,
) -> None:
    """Raise MessageRefusedError for values that every daemon refuses."""
    words = ""
    if qos is not None and qos not in QOS:
        words = f"qos: got {_shown(qos)}; allowed: {', '.join(QOS)}"
    elif priority is not None and not _is_within(priority, MAX_PRIORITY):
        words = f"priority: got {_shown(priority)}; allowed: 0 to {MAX_PRIORITY} (most urgent)"
    elif dst is not None and not _is_within(dst, BROADCAST):
        words = f"dst: got {_shown(dst)}; allowed: a robot's id, 0 to 254, or 255 for all"
    elif lifespan_ms is not None and not _is_above_0(lifespan_ms):
        words = f"lifespan_ms: got {_shown(lifespan_ms)}; allowed: a number above 0"
    elif published_ns is not None and not _is_within(published_ns, (1 << 63) - 1):
        words = f"published_ns: got {_shown(published_ns)}; allowed: nanoseconds since 1970"
    elif key is not None and not _is_short(key):
        words = f"key: got {_shown(key)}; allowed: text of up to {MAX_KEY_BYTES} bytes"
    if words:
        raise MessageRefusedError("tx_bad_envelope", words)


def unknown_topic(name: str, known: Iterable[str]) -> str:
    """The error text for a topic that the daemon does not accept."""
    # Imported only after a mistake, as it is rarely needed.
    from difflib import get_close_matches

    names = list(known)
    # For a bare name such as `odom`, the last parts of the known names match better.
    by_last_part = {_last_part(each): each for each in names}
    close = get_close_matches(name, names, 1) or [
        by_last_part[each] for each in get_close_matches(_last_part(name), by_last_part, 1)
    ]
    hint = f" did you mean {close[0]}?" if close else ""
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    allowed = ", ".join(names[:MOST_NAMES]) or "none"
    return f"topic: got {_shown(name)};{hint} allowed: {allowed}{more}"


def too_short(name: str, size: int) -> str:
    """The error text for a message shorter than a CDR header."""
    return f"{name}: too short: {size} B; CDR begins with a header of {CDR_HEADER_SIZE} B"


def too_large(name: str, size: int, most: int, key: str) -> str:
    """The error text for a message larger than the setting `key` allows."""
    return f"{name}: too large: {size} B; at most {most} B with {key}"


def wrong_type(name: str, given: str, registered: str) -> str:
    """The error text for a message type that differs from the registry's."""
    return f"type: got {_shown(given)}; allowed: {registered}, the type of {name} in the registry"


def _last_part(name: str) -> str:
    return name.rpartition("/")[2]


def _shown(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else f"{value}"


def _is_within(value: object, most: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= most


def _is_short(value: object) -> bool:
    return isinstance(value, str) and len(value.encode(errors="replace")) <= MAX_KEY_BYTES


def _is_above_0(value: object) -> bool:
    # The comparison is false for NaN, as it should be.
    return isinstance(value, int | float) and not isinstance(value, bool) and value > 0
