"""An outgoing message, and the structure of the queue in which it waits.

A *lane* is one topic at one class, priority and destination; messages keep their order within it.
Lanes of equal class and priority form a *level*.
"""

from collections import OrderedDict, deque
from dataclasses import dataclass, field
from math import inf

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue.fate import STEPS, Fate, Step
from sdrlinkd.link.queue.ledger import TxTally
from sdrlinkd.link.queue.parting import Parting
from sdrlinkd.wire import PARTS, overhead


class Outgoing:
    """One outgoing message. Any code may read its fields; only its methods change them."""

    __slots__ = (
        "_parting", "arrived_at", "body", "channel", "dst", "entry_id", "expires_at", "fate",
        "has_left", "held_ids", "ids", "is_bare", "is_command", "is_compressed", "is_expected",
        "is_whole", "k", "key", "lane", "last_at", "n_repeats", "next_index", "overhead", "parity",
        "parts_left", "payload", "pdu_number", "priority", "qos", "receipt", "rests_id", "stamped",
        "tally", "topic_id", "total", "unconfirmed",
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
        key: str = "",
        number: int | None = None,
        parting: Parting | None = None,
        is_command: bool = False,
        is_compressed: bool = False,
        is_whole: bool = False,
        pdu_number: int | None = None,
        is_bare: bool = False,
    ) -> None:
        """Make a queued message.

        `receipt` is the producer's id for the receipt, empty if none is wanted, and `key` its
        producer key. `number` is the topic's number on the air if that is not `topic_id`. `parting`
        says how to divide a large message, whose parts are cut one after the other. `is_command`
        means that it is dropped at the end of its lifespan even if it has begun; `is_whole`, that
        the payload is another robot's PDU to be relayed, with `pdu_number` if known; `is_bare`,
        that this PDU holds only control records.
        """
        self.topic_id = topic_id
        self.payload = payload
        self.qos = qos
        self.priority = priority
        self.dst = dst
        self.arrived_at = arrived_at
        self.expires_at = expires_at
        # The age of a large message goes with its last part.
        self.stamped = not wants_stamp or parting is not None
        self.tally = tally
        self.receipt = receipt
        self.key = key
        self.is_command = is_command
        self.is_compressed = is_compressed
        self.is_whole = is_whole
        self.pdu_number = pdu_number
        self.is_bare = is_bare
        self.channel = topic_id if number is None else number
        """The topic id of its entries on the air; PARTS for a large message."""
        self.body = payload
        """The octets that are cut into fragments: the message, or its present part."""
        self._parting = parting
        self.parts_left = 0
        """How many parts follow the present one."""
        self.fate = Fate.QUEUED
        self.lane: Lane
        # Set when the first fragment is cut, and fixed from then on.
        self.entry_id = 0
        self.k = 0
        self.total = 0
        self.next_index = 0
        self.last_at = 0.0
        """Planned start of the burst with the latest fragment."""
        self.rests_id = False
        self.ids: tuple[int, ...] = ()
        """All entry ids that the message has used: one for each part."""
        self.held_ids: tuple[int, ...] = ()
        """Those held, as fragments leave later than planned."""
        self.has_left = False
        """Whether the radio has reported that a PDU with a part of the message left."""
        self.unconfirmed = 0
        """Number of PDUs with a part of the message whose outcome the radio has not reported."""
        self.parity: list[bytes] = []
        """Parity records that follow the last fragment, in reverse order."""
        self.n_repeats = 0
        """How often PDUs with parts of it were sent again."""
        self.is_expected = False
        """Whether receipts were requested from the receivers."""
        if parting is not None:
            self.parts_left = parting.count_of(payload)
            self.channel = PARTS
            self._next_body()
        self.overhead = overhead(self.channel)
        """Octets of each fragment besides those of the body."""

    @property
    def src(self) -> int:
        """Source of the PDU, if the message is a relayed PDU."""
        return self.payload[1]

    @property
    def is_through(self) -> bool:
        """Whether all parts of the message are in PDUs."""
        is_cut = 0 < self.total == self.next_index
        return is_cut and not self.parity and not self.parts_left

    @property
    def needs_id(self) -> bool:
        """Whether the next part of a message that has begun needs an entry id."""
        return bool(self.ids) and not self.total

    @property
    def next_size(self) -> int:
        """Octets of the present body that are in no PDU yet."""
        return max(0, len(self.body) - self.next_index * self.k)

    @property
    def worth_until(self) -> float:
        """When PDUs with parts of it are no longer worth sending.

        A lifespan decides whether a message begins: what has begun is finished, except a command. A
        message that needs more airtime than its lifespan would never arrive otherwise. A PDU that
        was held back does not count as a beginning.
        """
        return inf if self._is_to_be_finished and self.has_left else self.expires_at

    @property
    def _is_to_be_finished(self) -> bool:
        """Whether it has begun, and more than one PDU carries it."""
        return self.rests_id and not self.is_command

    def in_vain(self, now: float, patience_s: float) -> str:
        """The ledger's reason to stop sending the message; empty while it is worth sending.

        Receivers give up a message when no part arrives for `patience_s`. A message that lacks only
        its parity is always worth sending, as a receiver may need just that.
        """
        if self.parity:
            return ""
        is_stalled = self.k > 0 and now > self.last_at + patience_s
        # A beginning that was only planned does not outlive a pause.
        goes_on = self._is_to_be_finished and (self.has_left or not is_stalled)
        if self.expires_at <= now and not goes_on:
            return "tx_expired"
        return "tx_stalled" if is_stalled else ""

    def step(self, step: Step) -> bool:
        """Take a step; False, without a change, if STEPS does not contain it."""
        fate = STEPS.get((self.fate, step))
        if fate is None:
            return False
        self.fate = fate
        return True

    def enter(self, lane: "Lane") -> None:
        """Note the lane that the message waits in."""
        self.lane = lane

    def cut(self, entry_id: int, k: int, total: int, start: float) -> None:
        """Note that the body becomes `total` fragments of `k` bytes, sent from `start` on."""
        self.entry_id, self.k, self.total, self.last_at = entry_id, k, total, start
        self.ids = (*self.ids, entry_id)
        if self._parting is not None and not self.parts_left:
            self.stamped = not self._parting.wants_stamp
        self.rests_id = total > 1 or self.channel == PARTS

    def go_on(self) -> bool:
        """Turn to the next part; False if there is none."""
        if not self.parts_left:
            return False
        self._next_body()
        return True

    def advance(self, n: int, start: float) -> None:
        """Note that the next `n` fragments are in one PDU each, for a burst at `start`."""
        self.next_index += n
        self.unconfirmed += n
        self.last_at = start

    def follow_with(self, parity: list[bytes]) -> None:
        """Add parity records, in reverse order, to be sent after the last fragment."""
        self.parity = parity

    def give_parity(self) -> bytes:
        """Take out the next parity record, which is now in a PDU."""
        return self.parity.pop()

    def ride(self) -> None:
        """Note that one more PDU holds parity of the message."""
        self.unconfirmed += 1

    def repeat(self) -> None:
        """Note that one more PDU with a part of the message was sent again."""
        self.n_repeats += 1

    def stamp(self) -> None:
        """Note that the message's age is in a PDU."""
        self.stamped = True

    def keep_id(self) -> None:
        """Make the entry id rest after use, even for a short message, as its STAMP went ahead."""
        self.rests_id = True

    def hold_ids(self, held: tuple[int, ...]) -> None:
        """Note which entry ids are held for fragments that leave later than planned."""
        self.held_ids = held

    def expect(self) -> None:
        """Note that receipts were requested from the receivers."""
        self.is_expected = True

    def owe(self, octets: float) -> None:
        """Charge its topic for octets that do not come from the queue, when it is served next."""
        self.lane.account.owe(octets)

    def confirm(self, *, has_left: bool) -> None:
        """Note that the radio has reported the outcome of one PDU with a part of the message."""
        self.unconfirmed -= 1
        self.has_left = self.has_left or has_left

    def _next_body(self) -> None:
        if self._parting is not None:
            self.body = self._parting.part(self.payload, self.parts_left)
            self.parts_left -= 1
            self.next_index = self.total = 0


class Account:
    """What one topic has sent at one class and priority, in octets divided by its weight."""

    __slots__ = ("lanes", "owed", "spent", "topic_id", "weight")

    def __init__(self, topic_id: int) -> None:
        self.topic_id = topic_id
        self.weight = 1.0
        self.spent = -inf
        self.owed = 0.0
        """Octets that are charged when the topic is served next."""
        self.lanes: list[Lane] = []
        """The topic's lanes that have something to send."""

    def owe(self, octets: float) -> None:
        """Charge octets when the topic is served next: to sort it in at once costs too much."""
        self.owed += octets

    def pay(self, octets: float = 0.0) -> None:
        """Charge octets, and those that are owed."""
        self.spent += (octets + self.owed) / self.weight
        self.owed = 0.0

    def forgive(self, most: float) -> None:
        """Forget what was spent beyond `most`."""
        self.spent = min(self.spent, most)

    def catch_up(self, least: float) -> None:
        """Forget what was saved up beyond `least`."""
        self.spent = max(self.spent, least)


class Lane:
    """One topic at one class, priority and destination."""

    __slots__ = ("account", "current", "dst", "level_key", "order", "waiting")

    def __init__(self, account: Account, dst: int, level_key: tuple[int, int]) -> None:
        self.account = account
        self.dst = dst
        self.level_key = level_key
        """Class, and priority with its sign changed."""
        self.current: Outgoing | None = None
        self.waiting: deque[Outgoing] = deque()
        self.order: tuple[float, float, int] = (0.0, 0.0, 0)

    @property
    def topic_id(self) -> int:
        """The topic of its messages."""
        return self.account.topic_id

    @property
    def head(self) -> Outgoing | None:
        """The message whose fragment is sent next."""
        return self.current or (self.waiting[0] if self.waiting else None)


NONE_QUEUED: OrderedDict[Outgoing, None] = OrderedDict()


@dataclass(slots=True)
class QueuedOfTopic:
    """One topic's messages of which no part has been sent yet, the oldest first."""

    messages: OrderedDict[Outgoing, None] = field(default_factory=OrderedDict)
    by_key: dict[tuple[str, int], OrderedDict[Outgoing, None]] = field(default_factory=dict)
    """By producer key and destination."""
    n_bytes: int = 0

    @property
    def oldest(self) -> Outgoing:
        """The oldest message."""
        return next(iter(self.messages))

    def like(self, message: Outgoing) -> OrderedDict[Outgoing, None]:
        """Messages with the producer key and the destination of this one."""
        return self.by_key.get((message.key, message.dst)) or NONE_QUEUED

    def add(self, message: Outgoing) -> None:
        """Add the newest message."""
        self.messages[message] = None
        self.by_key.setdefault((message.key, message.dst), OrderedDict())[message] = None
        self.n_bytes += len(message.payload)

    def remove(self, message: Outgoing) -> None:
        """Remove a message."""
        del self.messages[message]
        key = message.key, message.dst
        del self.by_key[key][message]
        if not self.by_key[key]:
            del self.by_key[key]
        self.n_bytes -= len(message.payload)
