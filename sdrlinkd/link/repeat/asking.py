"""What this robot lacks of others, and when it asks for it."""

from collections.abc import Callable, Collection
from math import inf

import msgspec

from sdrlinkd.link.receive import PduPlaced
from sdrlinkd.link.repeat.gaps import Message, inside, parts
from sdrlinkd.link.repeat.missing import ALONE_S, PATIENCE_S, Missing, Source
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

KEEP_S = 1.0
"""Time in s after which its source has forgotten a PDU."""
MOST_MISSING = 512
"""Most PDUs of one source that are asked for."""
Holds = Callable[[int, int, int], bool]


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
        self._sources: dict[int, Source] = {}
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
            source = self._sources[pdu.src] = Source()
        if source.missing:
            self._filled(source, event)
        is_useful = event.is_wanted and event.read.control.n_entries < len(pdu.entries)
        if source.came(event, is_useful=is_useful):
            self._look_ahead()
        for record in event.read.records:
            if isinstance(record, Parity):
                source.parity_at[record.topic_id] = event.at
        before = source.last
        if before is not None and event.number < before.number:
            return
        source.last = event
        is_wanted = event.is_wanted or (before is not None and before.is_wanted)
        if event.skipped and is_wanted and source.is_asked:
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
                    source.asked(missing, start)
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

    def _filled(self, source: Source, event: PduPlaced) -> None:
        missing = source.missing.pop(event.number % PDU_NUMBERS, None)
        if missing is not None:
            source.filled(missing, event.at)
            self._look_ahead()

    def _skipped(self, source: Source, before: PduPlaced | None, event: PduPlaced) -> None:
        held: frozenset[Message] = frozenset()
        is_relayed = source.hears_relays
        for number in event.skipped[-MOST_MISSING:]:
            # A relay holds no messages; it lacks whatever it has to forward.
            is_ours = event.is_ours and before is not None and before.is_ours
            if is_ours and before is not None and number == before.number + 1:
                held = inside(before, event)
            source.missing[number % PDU_NUMBERS] = Missing(
                number, event.at, event.at + source.patience_s, held, is_relayed, is_relayed
            )
        while len(source.missing) > MOST_MISSING:
            del source.missing[next(iter(source.missing))]
            self._given_up += 1
        self._look_ahead()

    def _drop_bare(self, source: Source, event: PduPlaced) -> None:
        """Do not ask for PDUs that hold nothing that is repeated."""
        for record in event.read.records:
            if isinstance(record, Bare):
                for number in record.numbers(event.number):
                    source.missing.pop(number % PDU_NUMBERS, None)
                self._look_ahead()

    def _drop_needless(self, src: int, source: Source, now: float) -> None:
        for number, each in list(source.missing.items()):
            is_over = bool(each.inside) and not any(
                self._holds(src, *message) for message in each.inside
            )
            if is_over or each.since < now - KEEP_S:
                del source.missing[number]
                self._given_up += not is_over

    def _waits(self, source: Source, missing: Missing, now: float) -> bool:
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
            message in running and (message[0] == PARTS or source.has_parity(message[0]))
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
