"""What this robot lacks of others, and when it asks for it."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from math import inf

import msgspec

from sdrlinkd.link.receive import PduPlaced
from sdrlinkd.link.repeat.gaps import Message, inside, parts
from sdrlinkd.link.schedule import Budget
from sdrlinkd.reports import RepeatReport
from sdrlinkd.wire import (
    NEED_OVERHEAD,
    PARTS,
    PDU_NUMBERS,
    Bare,
    Need,
    Parity,
    needs,
)

PATIENCE_S = 0.005
"""Time in s for which a PDU may still come out of order."""
RELAYED_PATIENCE_S = 0.05
"""The same where a relay may bring it."""
ALONE_S = 0.05
"""Time in s for which a question about one PDU waits for spare room; about n PDUs: one n-th."""
ASKS = 3
"""How often a PDU is asked for."""
FIRST_AGAIN_S = 0.04
LEAST_AGAIN_S, MOST_AGAIN_S = 0.02, 0.3
"""Limits of the time in s after which a PDU is asked for again."""
WEIGHT = 0.25
"""Weight of the newest answer in the mean time of answers."""
KEEP_S = 1.0
"""Time in s after which its source has forgotten a PDU."""
MOST_MISSING = 512
"""Most PDUs of one source that are asked for."""
USEFUL, USEFUL_WEIGHT = 0.05, 0.02
"""Share of PDUs with messages for us from which a question gets a PDU of its own."""

Holds = Callable[[int, int, int], bool]


@dataclass(slots=True)
class _Missing:
    since: float
    next_at: float
    inside: frozenset[Message]
    """The messages of which it held a part."""
    asks_left: int = ASKS
    others_asked: bool = False
    """Whether another robot has asked for it."""
    asked_at: float = -inf


@dataclass(slots=True)
class _Source:
    missing: dict[int, _Missing] = field(default_factory=dict)
    last: PduPlaced | None = None
    has_parity: set[int] = field(default_factory=set)
    """Topics whose messages have parity."""
    useful: float = 0.0
    """Share of its recent PDUs with messages for us."""
    answer_s: float = FIRST_AGAIN_S / 2
    """Mean time from a question to its answer."""
    hears_relays: bool = False
    heard_at: float = -inf
    """When its last new PDU came."""

    @property
    def again_s(self) -> float:
        return min(max(2 * self.answer_s, LEAST_AGAIN_S), MOST_AGAIN_S)

    def alone_at(self, times: list[float]) -> float:
        """When a question about PDUs to be asked for at `times` gets a PDU of its own."""
        return min(times) + ALONE_S / len(times) if self.useful > USEFUL else inf


class Asking:
    """The PDUs that are missing, by source, and when to ask for them.

    `holds(src, topic, entry id)`: whether fragments of a message are held that lacks others. PDUs
    that hold only questions take at most `share` of the air.
    """

    def __init__(self, holds: Holds, share: float, room: int) -> None:
        self._holds = holds
        self._most = max(1, room - NEED_OVERHEAD)
        """Most octets of a bitmap, so that a question fits into a PDU."""
        self._is_on = share > 0
        self._budget = Budget(share)
        self._sources: dict[int, _Source] = {}
        self.due_at = inf
        """When to ask next."""
        self.alone_at = inf
        """When a question gets a PDU of its own."""
        self.is_offered = False
        """Whether questions wait for a burst."""
        self._offered: list[tuple[int, list[int]]] = []
        self._free_at = -inf
        """When the share of the air allows a PDU with questions."""
        self._asked = self._given_up = 0

    def placed(self, event: PduPlaced) -> None:
        """Take a new PDU, which may show that others before it are missing."""
        pdu = event.read.pdu
        if not self._is_on:
            return
        source = self._sources.get(pdu.src)
        if source is None:
            source = self._sources[pdu.src] = _Source()
        if source.missing:
            self._filled(source, event)
        source.heard_at = event.at
        is_useful = event.is_wanted and event.read.control.n_entries < len(pdu.entries)
        source.useful += USEFUL_WEIGHT * (is_useful - source.useful)
        source.hears_relays = source.hears_relays or event.read.is_forwarded
        for record in event.read.records:
            if isinstance(record, Parity):
                source.has_parity.add(record.topic_id)
        before = source.last
        if before is not None and event.number < before.number:
            return
        source.last = event
        is_wanted = event.is_wanted or (before is not None and before.is_wanted)
        if event.skipped and is_wanted:
            self._skipped(source, before, event)
        if source.missing:
            self._drop_bare(source, event)

    def others_need(self, need: Need, at: float) -> None:
        """Take the question of another robot: what we lack, too, need not be asked for again."""
        source = self._sources.get(need.node)
        if source is None or not source.missing:
            return
        for number in need.numbers():
            missing = source.missing.get(number)
            if missing is not None and not missing.others_asked:
                missing.others_asked = True
                missing.next_at = max(missing.next_at, at + source.again_s)
        self._look_ahead()

    def questions(self, now: float) -> list[Need]:
        """What to ask at `now`, if there is room."""
        self._offered = []
        found: list[Need] = []
        for src, source in self._sources.items():
            if not source.missing:
                continue
            self._drop_needless(src, source, now)
            due = sorted(
                number
                for number, each in source.missing.items()
                if each.next_at <= now and not self._waits(source, each, now)
            )
            if due:
                self._offered.append((src, due))
                found += needs(src, due, self._most)
        self.is_offered = bool(found)
        self._look_ahead()
        return found

    @property
    def offered_alone_at(self) -> float:
        """From when the questions returned last have a PDU of their own; infinity: never."""
        alone_at = inf
        for src, numbers in self._offered:
            source = self._sources[src]
            times = [source.missing[number].next_at for number in numbers]
            alone_at = min(alone_at, source.alone_at(times))
        return max(alone_at, self._free_at)

    def asked(self, start: float, waiting: Collection[int], alone_s: float) -> None:
        """Note that the questions returned last are in a burst at `start`.

        Those about the robots `waiting` found no room. `alone_s` is the airtime of a PDU of their
        own.
        """
        self._budget.spend(alone_s, start)
        for src, numbers in self._offered:
            if src in waiting:
                continue
            source = self._sources[src]
            for number in numbers:
                missing = source.missing.get(number)
                if missing is not None:
                    self._asked += 1
                    self._count(source, missing, start)
        self._offered, self.is_offered = [], False
        self._look_ahead()

    def forget(self, src: int) -> None:
        """Forget what was missing of a robot that has restarted."""
        self._sources.pop(src, None)
        self._offered = [each for each in self._offered if each[0] != src]
        self.is_offered = bool(self._offered)
        self._look_ahead()

    def restart(self) -> None:
        """Go on with another clock; what was missing is forgotten."""
        self._sources.clear()
        self._offered, self.is_offered = [], False
        self._budget.restart()
        self._look_ahead()

    def report(self, answers: RepeatReport) -> RepeatReport:
        """The report on what others asked us, and what we asked them."""
        return msgspec.structs.replace(answers, asked=self._asked, given_up=self._given_up)

    def _filled(self, source: _Source, event: PduPlaced) -> None:
        missing = source.missing.pop(event.number % PDU_NUMBERS, None)
        if missing is not None:
            if missing.asked_at > -inf and missing.asks_left == ASKS - 1:
                answer_s = event.at - missing.asked_at
                source.answer_s += WEIGHT * (answer_s - source.answer_s)
            self._look_ahead()

    def _skipped(self, source: _Source, before: PduPlaced | None, event: PduPlaced) -> None:
        patience_s = RELAYED_PATIENCE_S if source.hears_relays else PATIENCE_S
        held: frozenset[Message] = frozenset()
        for number in event.skipped[-MOST_MISSING:]:
            # A relay holds no messages; it lacks whatever it has to forward.
            is_ours = event.is_ours and before is not None and before.is_ours
            if is_ours and before is not None and number == before.number + 1:
                held = inside(before, event)
            source.missing[number % PDU_NUMBERS] = _Missing(event.at, event.at + patience_s, held)
        while len(source.missing) > MOST_MISSING:
            del source.missing[next(iter(source.missing))]
            self._given_up += 1
        self._look_ahead()

    def _drop_bare(self, source: _Source, event: PduPlaced) -> None:
        """Do not ask for PDUs that hold nothing that is repeated."""
        for record in event.read.records:
            if isinstance(record, Bare):
                for number in record.numbers(event.number):
                    source.missing.pop(number % PDU_NUMBERS, None)
                self._look_ahead()

    def _count(self, source: _Source, missing: _Missing, at: float) -> None:
        missing.asks_left -= 1
        missing.asked_at = at
        missing.next_at = at + source.again_s
        if missing.asks_left <= 0:
            # Its answer may still come, but nobody asks again.
            missing.next_at = inf

    def _drop_needless(self, src: int, source: _Source, now: float) -> None:
        for number, each in list(source.missing.items()):
            is_over = bool(each.inside) and not any(
                self._holds(src, *message) for message in each.inside
            )
            if is_over or each.since < now - KEEP_S:
                del source.missing[number]
                self._given_up += not is_over

    def _waits(self, source: _Source, missing: _Missing, now: float) -> bool:
        """Whether to ask later: parity may still come, or the last question would be asked of a
        source of which nothing was heard since the one before.
        """
        if missing.asks_left == 1 and missing.asked_at >= source.heard_at:
            missing.next_at = now + source.again_s
            return True
        if not missing.inside or source.last is None or now - source.last.at > ALONE_S:
            return False
        running = parts(source.last)
        awaits_parity = any(
            message in running and (message[0] == PARTS or message[0] in source.has_parity)
            for message in missing.inside
        )
        if awaits_parity:
            missing.next_at = now + PATIENCE_S
        return awaits_parity

    def _look_ahead(self) -> None:
        self.due_at = self.alone_at = inf
        self._free_at = self._budget.next_at
        for source in self._sources.values():
            if source.missing:
                times = [each.next_at for each in source.missing.values()]
                next_at = min(times)
                self.due_at = min(self.due_at, next_at)
                together = [at for at in times if at <= next_at + PATIENCE_S]
                self.alone_at = min(self.alone_at, source.alone_at(together))
        self.alone_at = max(self.alone_at, self._free_at)
