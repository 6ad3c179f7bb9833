"""A message on its way out, and the order that it waits in.

A *lane* is one topic at one class, priority and destination; inside it messages keep their order.
Lanes of equal class and priority form a *level*.
"""

from collections import deque
from collections.abc import Sequence
from enum import Enum, auto

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue.ledger import TxTally


class Fate(Enum):
    """Where a message stands in the ledger."""

    QUEUED = auto()
    IN_FLIGHT = auto()
    SENT = auto()
    DROPPED = auto()


class Outgoing:
    """One message on its way out."""

    __slots__ = (
        "arrived_at", "dst", "entry_id", "expires_at", "fate", "is_compressed", "is_expected",
        "is_held",
        "is_whole", "k", "lane", "last_at", "next_index", "parity", "payload", "priority", "qos",
        "receipt", "rests_id", "stamped", "tally", "topic_id", "total", "unconfirmed",
    )  # fmt: skip

    def __init__(
        self,
        topic_id: int,
        payload: bytes,
        qos: Qos,
        priority: int,
        dst: int,
        arrived_at: float,
        expires_at: float,
        wants_stamp: bool,
        tally: TxTally,
    ) -> None:
        self.topic_id = topic_id
        self.payload = payload
        self.qos = qos
        self.priority = priority
        self.dst = dst
        self.arrived_at = arrived_at
        self.expires_at = expires_at
        self.stamped = not wants_stamp
        self.tally = tally
        self.fate = Fate.QUEUED
        self.lane: Lane
        # Set when the first fragment is cut, then frozen.
        self.entry_id = 0
        self.k = 0
        self.total = 0
        self.next_index = 0
        self.last_at = 0.0
        """When the burst with its last fragment so far was to leave."""
        self.rests_id = False
        self.is_held = False
        self.unconfirmed = 0
        self.is_compressed = False
        self.receipt = ""
        """Under this name its producer wants to know what becomes of it."""
        self.parity: list[bytes] = []
        """Control records that follow its last fragment, the first one last."""
        self.is_expected = False
        """The far ends were asked what becomes of it."""
        self.is_whole = False
        """The payload is another robot's PDU, to be sent on."""

    @property
    def src(self) -> int:
        """Whose PDU it is, where it is whole."""
        return self.payload[1]

    @property
    def is_through(self) -> bool:
        """Whether all of it is in PDUs."""
        return self.next_index == self.total and not self.parity


class Lane:
    """One topic at one class, priority and destination."""

    __slots__ = ("current", "dst", "level", "order", "topic_id", "waiting")

    def __init__(self, topic_id: int, dst: int, level: "Level") -> None:
        self.topic_id = topic_id
        self.dst = dst
        self.level = level
        self.current: Outgoing | None = None
        self.waiting: deque[Outgoing] = deque()
        self.order: tuple[float, int] = (0.0, 0)

    @property
    def head(self) -> Outgoing | None:
        """The message whose fragment goes next."""
        return self.current or (self.waiting[0] if self.waiting else None)


class Level:
    """The non-empty lanes of one class and priority, in service order."""

    __slots__ = ("key", "lanes", "per_dst")

    def __init__(self, key: tuple[int, int]) -> None:
        self.key = key
        self.lanes: list[Lane] = []
        self.per_dst: dict[int, int] = {}


def with_first(levels: Sequence[Level], first: Qos) -> list[Level]:
    """In service order, but those of class `first` before all others."""
    return sorted(levels, key=lambda level: (level.key[0] != first, level.key))
