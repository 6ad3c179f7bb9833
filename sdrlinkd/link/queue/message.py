"""A message on its way out, and the order that it waits in.

A *lane* is one topic at one class, priority and destination; inside it messages keep their order.
Lanes of equal class and priority form a *level*.
"""

from collections import deque
from collections.abc import Mapping, Sequence
from enum import IntEnum, auto

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue.ledger import TxTally


class Fate(IntEnum):
    """Where a message stands in the ledger."""

    QUEUED = auto()
    IN_FLIGHT = auto()
    SENT = auto()
    DROPPED = auto()


class Step(IntEnum):
    """What can become of a message."""

    BEGIN = auto()
    """Its first fragment is cut."""
    LEAVE = auto()
    """The radio has sent all of it."""
    DROP = auto()
    """It ends under one of the ledger's reasons."""


STEPS: Mapping[tuple[Fate, Step], Fate] = {
    (Fate.QUEUED, Step.BEGIN): Fate.IN_FLIGHT,
    (Fate.QUEUED, Step.DROP): Fate.DROPPED,
    (Fate.IN_FLIGHT, Step.LEAVE): Fate.SENT,
    (Fate.IN_FLIGHT, Step.DROP): Fate.DROPPED,
}
"""A message's life: the steps that are allowed, and where each leads. What entered is the sum of
those that stand in each fate, so this is the ledger, too."""


class Outgoing:
    """One message on its way out. Everyone reads its fields; only its verbs change them."""

    __slots__ = (
        "arrived_at", "dst", "entry_id", "expires_at", "fate", "is_compressed", "is_expected",
        "is_held", "is_whole", "k", "lane", "last_at", "next_index", "parity", "payload",
        "priority", "qos", "receipt", "rests_id", "stamped", "tally", "topic_id", "total",
        "unconfirmed",
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
        *,
        receipt: str = "",
        is_compressed: bool = False,
        is_whole: bool = False,
    ) -> None:
        """Queued. `receipt`: its producer wants to know what becomes of it, under that name.

        `is_whole`: the payload is another robot's PDU, to be sent on.
        """
        self.topic_id = topic_id
        self.payload = payload
        self.qos = qos
        self.priority = priority
        self.dst = dst
        self.arrived_at = arrived_at
        self.expires_at = expires_at
        self.stamped = not wants_stamp
        self.tally = tally
        self.receipt = receipt
        self.is_compressed = is_compressed
        self.is_whole = is_whole
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
        """Its entry id waits for fragments that leave later than they were made for."""
        self.unconfirmed = 0
        """PDUs with a part of it of which the radio has not told yet."""
        self.parity: list[bytes] = []
        """Control records that follow its last fragment, the first one last."""
        self.is_expected = False
        """The far ends were asked what becomes of it."""

    @property
    def src(self) -> int:
        """Whose PDU it is, where it is whole."""
        return self.payload[1]

    @property
    def is_through(self) -> bool:
        """Whether all of it is in PDUs."""
        return self.next_index == self.total and not self.parity

    def in_vain(self, now: float, patience_s: float) -> str:
        """The ledger's reason for sending no more of it; empty while it is worth sending.

        Receivers give up a message of which nothing came for `patience_s`. What has gone whole but
        for its parity is never in vain: somebody may lack just that.
        """
        if self.parity:
            return ""
        if self.expires_at <= now:
            return "tx_expired"
        return "tx_stalled" if self.k and now > self.last_at + patience_s else ""

    def step(self, step: Step) -> bool:
        """Take a step of its life; False where STEPS has no such step, and nothing changes."""
        fate = STEPS.get((self.fate, step))
        if fate is None:
            return False
        self.fate = fate
        return True

    def enter(self, lane: "Lane") -> None:
        """Note the lane that the message waits in."""
        self.lane = lane

    def cut(self, entry_id: int, k: int, total: int, start: float) -> None:
        """Note that it becomes `total` fragments of `k` bytes, for bursts from `start` on."""
        self.entry_id, self.k, self.total, self.last_at = entry_id, k, total, start
        self.rests_id = total > 1

    def advance(self, n: int, start: float) -> None:
        """Note that the next `n` fragments are in a PDU each, for a burst at `start`."""
        self.next_index += n
        self.unconfirmed += n
        self.last_at = start

    def follow_with(self, parity: list[bytes]) -> None:
        """Have records of parity follow the last fragment; the first record stands last."""
        self.parity = parity

    def give_parity(self) -> bytes:
        """The next record, which is in a PDU now."""
        return self.parity.pop()

    def ride(self) -> None:
        """Note that one more PDU has a part of the message that is no fragment."""
        self.unconfirmed += 1

    def stamp(self) -> None:
        """Note that the message's age is in a PDU."""
        self.stamped = True

    def keep_id(self) -> None:
        """Have the entry id rest, however short the message is: something of it has left ahead."""
        self.rests_id = True

    def hold_id(self, is_held: bool) -> None:
        """Note whether the entry id waits for fragments that leave later."""
        self.is_held = is_held

    def expect(self) -> None:
        """Note that the far ends have been asked what becomes of the message."""
        self.is_expected = True

    def confirm(self) -> None:
        """Note that the radio has told of one PDU with a part of the message."""
        self.unconfirmed -= 1


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

    __slots__ = ("key", "lanes", "per_dst", "qos")

    def __init__(self, key: tuple[int, int]) -> None:
        self.key = key
        self.qos = Qos(key[0])
        self.lanes: list[Lane] = []
        self.per_dst: dict[int, int] = {}


def with_first(levels: Sequence[Level], first: Qos) -> list[Level]:
    """In service order, but those of class `first` before all others."""
    return sorted(levels, key=lambda level: (level.qos is not first, level.key))
