"""What is missing of one source, and when to ask for it."""

from dataclasses import dataclass, field
from math import inf

from sdrlinkd.link.qos import CLASSES, Qos
from sdrlinkd.link.receive import PduPlaced
from sdrlinkd.link.repeat.gaps import Message

PATIENCE_S = 0.005
"""Time in s for which a PDU may still come out of order."""
OVERTAKEN_S = 0.2
"""The same in s where it may wait at a relay, behind more urgent ones."""
ACTIVE_S = 0.5
"""Time in s for which a class counts as used by a source."""
ALONE_S = 0.05
"""Time in s for which a question about one PDU waits for spare room; about n PDUs: one n-th."""
ASKS, RELAYED_ASKS = 3, 6
"""How often a PDU is asked for: of its source, or of a relay, which may be asking for it itself."""
FIRST_AGAIN_S = 0.04
LEAST_AGAIN_S, MOST_AGAIN_S = 0.02, 0.3
"""Limits of the time in s after which a PDU is asked for again."""
WEIGHT, UNSURE_WEIGHT = 0.25, 0.0625
"""Weight of the newest answer in the mean time of answers: to the only question about its PDU, and
to one of several, of which it may be the first or the last."""
USEFUL, USEFUL_WEIGHT = 0.05, 0.02
"""Share of PDUs with messages for us from which a question gets a PDU of its own."""
RELAYED_S = 2.0
"""Time in s after its last PDU over a relay for which others of a source may come over one."""
PARITY_S = 10.0
"""Time in s after the last parity of a topic for which its messages are taken to have some."""
HARDLY = 1e-4
"""Share of PDUs with messages for us below which a source that relays bring is not asked."""


@dataclass(slots=True)
class Missing:
    """A PDU that is missing since `since`, and asked for at `next_at`."""

    number: int
    since: float
    next_at: float
    inside: frozenset[Message]
    """The messages of which it held a part."""
    is_relayed: bool = False
    may_wait: bool = False
    """Whether a relay may hold it back, behind more urgent ones."""
    asks: int = 0
    """How often it was asked for."""
    others_asked: bool = False
    """Whether another robot has asked for it."""
    asked_at: float = -inf
    first_asked_at: float = -inf

    @property
    def asks_left(self) -> int:
        """How often it may be asked for yet."""
        return (RELAYED_ASKS if self.is_relayed else ASKS) - self.asks


@dataclass(slots=True)
class Source:
    """What is missing of a source, by the lower 16 bits of the numbers; and what is known of it."""

    missing: dict[int, Missing] = field(default_factory=dict)
    last: PduPlaced | None = None
    parity_at: dict[int, float] = field(default_factory=dict)
    """When the last parity came, by topic."""
    useful: float = 0.0
    """Share of its recent PDUs with messages for us."""
    answer_s: float = FIRST_AGAIN_S / 2
    """Mean time from a question to its answer."""
    heard_at: float = -inf
    """When its last new PDU came."""
    relayed_at: float = -inf
    """When its last new PDU came over a relay."""
    _reached: dict[Qos, tuple[int, float]] = field(default_factory=dict)
    """(highest number that came, when) by class, as the header tells it."""

    @property
    def again_s(self) -> float:
        """Time in s after which a PDU is asked for again."""
        return min(max(2 * self.answer_s, LEAST_AGAIN_S), MOST_AGAIN_S)

    @property
    def hears_relays(self) -> bool:
        """Whether its PDUs come over relays."""
        return self.heard_at < self.relayed_at + RELAYED_S

    @property
    def patience_s(self) -> float:
        """Time in s for which a PDU may still come unasked."""
        return OVERTAKEN_S if self.hears_relays else PATIENCE_S

    @property
    def is_asked(self) -> bool:
        """Whether to ask the source at all: relays leave out PDUs without messages."""
        return not self.hears_relays or self.useful > HARDLY

    def alone_at(self, times: list[float]) -> float:
        """When a question about PDUs to be asked for at `times` gets a PDU of its own."""
        return min(times) + ALONE_S / len(times) if self.useful > USEFUL else inf

    def came(self, event: PduPlaced, *, is_useful: bool) -> bool:
        """Note a new PDU; returns whether the times of others have changed.

        A relay sends the PDUs of a class in order, and less urgent ones later. So what is older
        than a PDU of the least urgent class does not wait there.
        """
        at, pdu = event.at, event.read.pdu
        self.heard_at = at
        self.useful += USEFUL_WEIGHT * (is_useful - self.useful)
        if event.read.is_forwarded:
            self.relayed_at = at
        if event.read.control.n_entries == len(pdu.entries):
            return False
        reached, _ = self._reached.get(CLASSES[pdu.qos], (event.number, at))
        self._reached[CLASSES[pdu.qos]] = max(event.number, reached), at
        lowest = max(each for each, (_, last) in self._reached.items() if last > at - ACTIVE_S)
        up_to, _ = self._reached[lowest]
        late = [each for each in self.missing.values() if each.may_wait and each.number < up_to]
        for each in late:
            each.may_wait = False
            each.next_at = min(each.next_at, at + PATIENCE_S)
        return bool(late)

    def asked(self, missing: Missing, at: float) -> None:
        """Note that a PDU was asked for at `at`."""
        if not missing.asks:
            missing.first_asked_at = at
        missing.asks += 1
        missing.asked_at = at
        again_s = self.again_s * (missing.asks if missing.is_relayed else 1)
        # The last answer may still come, but nobody asks again.
        missing.next_at = at + again_s if missing.asks_left > 0 else inf

    def filled(self, missing: Missing, at: float) -> None:
        """Note that a PDU came that was missing.

        It always counts from the first question. Otherwise answers that take longer than the mean
        promises, so that a second question is asked meanwhile, would never be learned.
        """
        if missing.asks:
            weight = WEIGHT if missing.asks == 1 else UNSURE_WEIGHT
            self.answer_s += weight * (at - missing.first_asked_at - self.answer_s)

    def has_parity(self, topic_id: int) -> bool:
        """Whether messages of a topic have parity."""
        return self.heard_at < self.parity_at.get(topic_id, -inf) + PARITY_S
