"""A topic of another robot, and its publishers here."""

import hashlib
import struct
import time
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any, NamedTuple

from sdrlink_ros.kinds import Kind
from sdrlinkd.client import Message

LINGER_S = 5.0
"""Time in s for which the demand for a topic lasts after its last subscriber here has gone."""
_LITTLE, _BIG = struct.Struct("<iI"), struct.Struct(">iI")
SECOND_NS = 1_000_000_000
DIGEST_SIZE = 16
MOST_SERIES = 32
"""Producers of a topic whose latched messages are remembered."""


class Source(NamedTuple):
    """A topic that another robot declares; `kept` messages of it are kept for late joiners."""

    robot: int
    name: str
    kind: str
    hash: str
    kept: int
    is_best_effort: bool
    bus: str

    @classmethod
    def told(cls, fields: Mapping[str, Any]) -> "Source":
        """A topic as the daemon tells it."""
        return cls(
            fields["robot"], fields["name"], fields["type"], fields["hash"], fields["latched"],
            fields["best_effort"], fields["topic"],
        )  # fmt: skip


class Outlet:
    """The publishers of a topic of another robot, by name here and series of the source.

    `is_command`: it commands this robot, so it is wanted whether anybody subscribes or not.
    """

    def __init__(
        self, source: Source, kind_: Kind, names: tuple[str, ...], is_command_: bool
    ) -> None:
        self.source = source
        self.kind = kind_
        self.names = names
        self.is_command = is_command_
        self.is_restamped = False
        self.publishers: dict[tuple[str, int], Any] = {}
        self.wanted_at = -LINGER_S
        self.gone_at: float | None = None
        """Since when it is not declared any more."""
        self.is_closed = False
        self.is_sealed: bool | None = None
        """Whether the last message came sealed; None: none has come."""
        self._came_ns: OrderedDict[tuple[int, bytes], int] = OrderedDict()
        """When each latched message came first, by its series and digest."""
        self.newest = (0, 0)
        """Number and time of reception of the newest message."""

    def is_known(self, message: Message) -> bool:
        """Whether a latched message was published here before; notes newer ones.

        It comes again from what the daemon keeps, or as its source has met this robot anew. A
        source that says the same again has published it after the first one came.
        """
        if self._came_before(message):
            return True
        came = message.number, message.received_ns
        if message.is_late and came[0] <= self.newest[0] and came[1] <= self.newest[1]:
            return True
        if message.number:
            self.newest = came
        return False

    def _came_before(self, message: Message) -> bool:
        if not self.source.kept:
            return False
        key = message.series, hashlib.blake2b(message.payload, digest_size=DIGEST_SIZE).digest()
        came_ns, published_ns = self._came_ns.get(key), message.published_ns
        if came_ns is not None and published_ns is not None and published_ns <= came_ns:
            return True
        self._came_ns[key] = message.received_ns or time.time_ns()
        self._came_ns.move_to_end(key)
        while len(self._came_ns) > MOST_SERIES * self.source.kept:
            self._came_ns.popitem(last=False)
        return False


def restamped(cdr: bytes, time_ns: int) -> bytes:
    """A message with `time_ns`, in ns since 1970, as the stamp of its std_msgs/Header."""
    form = _LITTLE if cdr[1] & 1 else _BIG
    return cdr[:4] + form.pack(*divmod(time_ns, SECOND_NS)) + cdr[4 + form.size :]
