"""Composes PDUs from queued messages, by the paper's packing policy (section 5.2), per class.

If two or more topics of equal class and priority have messages, a PDU holds two entries, with
fragments of k = max(k*(2), k_min) bytes, round robin. If only one topic has messages, a PDU holds a
single entry of k = P_max − 13 bytes. k is fixed at a message's first fragment. With `greedy`,
further entries of the same topics are added while they fit. Lower classes fill the remaining room.

The reasons: a header costs 8 bytes and an entry 5, so one large entry wastes least. But a topic
with every PDU to itself would delay topics of equal rank by the length of its message. k is fixed
because a receiver places fragments at index · k. All PDUs of a burst have one source: if a relay
mixed its own PDUs with relayed ones, receivers could not tell whose burst it was, and mini-slots
are ordered by that. The age is sent with a message's last fragment, where it is most exact: the
message may wait between its fragments.
"""

from collections.abc import Sequence
from random import Random

from sdrlinkd.link.packing.bare_numbers import BareNumbers
from sdrlinkd.link.packing.draft import FLAGS, NO_DST, BuiltPdu, Draft, EntryWriter
from sdrlinkd.link.packing.entry_ids import REST_FACTOR, TopicEntryIds
from sdrlinkd.link.packing.flush import Flush
from sdrlinkd.link.packing.head_of_line import HeadOfLine
from sdrlinkd.link.packing.piggyback import PiggybackRecords
from sdrlinkd.link.packing.record_pdus import RecordPdus
from sdrlinkd.link.packing.report import ComposerReport
from sdrlinkd.link.packing.single_entry import SingleEntry
from sdrlinkd.link.params import LinkParams
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Lane, Level, Outbox, Outgoing, with_first
from sdrlinkd.link.schedule import Allowance, ClassesParams
from sdrlinkd.wire import (
    BROADCAST,
    ENTRY_HEADER_SIZE,
    MAX_ENTRIES,
    PDU_NUMBERS,
    STAMP_SIZE,
    Record,
    equal_payload,
)

MAX_PDUS = 63
"""Most PDUs in a burst, for every PDU link."""
# Lanes searched while one PDU is filled; after that, the remaining room is not worth the search.
MAX_LANES_PER_PDU = 4 * MAX_ENTRIES
# With less room for another entry than this, a STAMP does not even fit after other records.
MIN_ROOM_FOR_STAMP = STAMP_SIZE - ENTRY_HEADER_SIZE - 1


class Composer:
    """Fills PDUs from the outbox; `rng` chooses the first sequence number and the entry ids."""

    def __init__(
        self, params: LinkParams, src: int, outbox: Outbox, piggyback: PiggybackRecords,
        rng: Random, reassembly_timeout_s: float, has_control: bool, classes: ClassesParams,
    ) -> None:  # fmt: skip
        self._pdu_size = params.pdu_size
        self._hop_limit = params.hop_limit
        self._is_greedy = params.greedy
        self._src = src
        self._outbox = outbox
        self._piggyback = piggyback
        self.next_number = rng.randrange(256)
        """The number of our next PDU; its lowest octet is the sequence number."""
        self._control_entry_id = rng.randrange(256)
        self._patience_s = reassembly_timeout_s
        self.entry_ids = TopicEntryIds(rng, REST_FACTOR * reassembly_timeout_s)
        self.k_single = self.k_whole = equal_payload(params.pdu_size, 1)
        """Payload bytes of a PDU with one entry, and of one that has no room for a record."""
        self._least_shared = max(equal_payload(params.pdu_size, 2), params.min_fragment)
        self._k_shared = min(self._least_shared, self.k_single)
        parity = {qos: classes.of(qos).parity * has_control for qos in Qos}
        self._writer = EntryWriter(outbox, self.entry_ids, self.k_single, self._k_shared, parity)
        self.asking = self._writer.asking
        """Messages just stamped whose producers want receipts."""
        self._head_of_line = HeadOfLine(outbox, self.entry_ids, reassembly_timeout_s)
        self._single_entry = SingleEntry(outbox, params, src, has_control)
        self._flush = Flush(params.flush_s, outbox, self.k_single, reassembly_timeout_s)
        self._pdus = 0
        self._entries = 0
        self._bare = BareNumbers()
        self._record_pdus = RecordPdus(params.pdu_size, piggyback, self._bare, self._finish)

    def leave_room(self, record: bytes) -> None:
        """From now on, cut messages so that each PDU has room for such a record."""
        draft = Draft(self._pdu_size)
        if record:
            draft.add_record(record)
        self.k_single = draft.room
        self._k_shared = min(self._least_shared, self.k_single)
        self._writer.leave_room(self.k_single, self._k_shared)
        self._flush.size = self.k_single

    def fill(
        self, start: float, allowance: Allowance, source: int | None = None, *,
        is_mixed: bool = False, told: bytes = b"",
    ) -> list[BuiltPdu]:  # fmt: skip
        """The PDUs of a burst whose preamble leaves at `start`; empty if there is nothing to send.

        Unless `is_mixed`, all PDUs have one source, `source` if given: receivers derive from it who
        may send next. The first one of ours has the record `told`.
        """
        built: list[BuiltPdu] = []
        outbox, most_of = self._outbox, allowance.most
        levels = outbox.levels
        # PDUs owed to a class take room from other classes and do not lengthen the burst.
        owed = list(allowance.owed[: max(1, max(most_of) - 1)])
        while levels and len(built) < MAX_PDUS:
            n, first, most = len(built), None, most_of[levels[0].qos]
            if built and not is_mixed:
                source = built[0].src
            if owed and n + len(owed) >= most and (n or most < 2):
                first = owed.pop(0)
            elif (
                owed
                and not n
                and not is_mixed
                and outbox.next_relayed(owed[0]) != outbox.next_relayed()
            ):
                # The owed PDU has another source, so it is sent alone.
                first, owed, most = owed[0], [], 0
            elif n >= most:
                break
            several: Sequence[BuiltPdu] = ()
            if first is None and not told and levels[0].lanes[0].current is not None:
                several = self._next_full(
                    start, max(1, min(most, MAX_PDUS) - n - len(owed)), source
                )
            if not several:
                pdu = self._next_pdu(start, first, source, told)
                if pdu is None and told:
                    # The next fragment was cut before there had to be room for a record.
                    pdu = self._next_pdu(start, first, source, b"")
                if pdu is None:
                    break
                told = b"" if pdu.src == self._src else told
                several = (pdu,)
            built += several
        self._pdus += len(built)
        self._entries += sum(len(pdu.carried) for pdu in built)
        return built

    def fill_with_records(
        self, start: float, first: Sequence[Record] = (), number: int | None = None
    ) -> list[BuiltPdu]:
        """A PDU with the records `first`, then with those that wait, for a burst at `start`.

        It has the `number` that was taken for it, if any. Empty if there are no records.
        """
        number = self.next_number if number is None else number
        return self._record_pdus.with_waiting(first, number, start)

    def fill_with_only(self, records: Sequence[Record]) -> list[BuiltPdu]:
        """A PDU with these records alone; empty if there are none."""
        return self._record_pdus.with_only(records, self.next_number)

    def next_wakeup(self, now: float) -> float:
        """Time at which `fill` may next have something to send; −inf: now; infinity: no traffic."""
        if not self._outbox.levels:
            return float("inf")
        if self._flush.is_on and self._flush.must_wait(now):
            return self._flush.due_at()
        return self.entry_ids.next_free_of(self._outbox.levels)

    def take_asking(self) -> list[Outgoing]:
        """The messages in `asking`, which is then emptied."""
        asking = [*self.asking]
        self.asking.clear()
        return asking

    def report(self) -> ComposerReport:
        """Counts of what was composed so far."""
        pdus = self._pdus + self._record_pdus.made
        return ComposerReport(self._entries, pdus, sorted(self.entry_ids.starved))

    def expire(self, now: float) -> None:
        """Drop messages that are pointless to send at `now`, although no burst could leave."""
        self._head_of_line.expire(now)

    def abandon(self, lane: Lane, now: float) -> None:
        """Send no more fragments of the message that `lane` has begun."""
        self._head_of_line.abandon(lane, now)

    def forwarded(self, octets: bytes, held_s: float) -> bytes:
        """Another robot's PDU, which came `held_s` before, for relaying it once more."""
        return self._single_entry.forwarded(octets, held_s)

    def take_number(self, n: int = 1) -> int:
        """Take the number of our next PDU, and of `n` - 1 after it."""
        number, self.next_number = self.next_number, (self.next_number + n) % PDU_NUMBERS
        return number

    def end_flush(self) -> None:
        """From now on, no partly filled PDU waits for more messages."""
        self._flush.end()

    def _next_pdu(
        self, start: float, first: Qos | None, source: int | None, told: bytes
    ) -> BuiltPdu | None:
        """The next PDU of a burst whose preamble leaves at `start`, or None.

        It starts with the most urgent class, or with class `first`. It is None if that PDU's source
        is not `source`. Messages that are pointless to send are dropped; see `HeadOfLine`.
        """
        outbox = self._outbox
        levels = outbox.levels
        if not levels or (self._flush.is_on and self._flush.must_wait(start)):
            return None
        may_be_own = source is None or source == self._src
        draft = Draft(self._pdu_size)
        if told:
            draft.add_record(told)
        room, looked_at = draft.room, 0
        order = levels if first is None else with_first(levels, first)
        for level in tuple(order):
            may_relay = outbox.relays and draft.dst == NO_DST
            if may_relay and (whole := self._next_whole(level, start)):
                if source in (None, whole.src):
                    return self._single_entry.relayed(whole, start)
                return None
            if not may_be_own:
                return None
            looked_at += len(level.lanes)
            if draft.room >= self._k_shared or self._writer.may_fit(level, draft.room):
                self._fill_from(level, draft, start)
            if draft.room <= 0 or (looked_at > MAX_LANES_PER_PDU and draft.dst != NO_DST):
                break
        if draft.dst == NO_DST:
            return None
        if draft.room >= MIN_ROOM_FOR_STAMP:
            for message in draft.carried:
                if not message.stamped:
                    self._writer.stamp(draft, message, start)
        unused = draft.room
        if self._piggyback.waiting and draft.dst == BROADCAST:
            self._piggyback.ride(draft, start, self.next_number)
        if self._bare.untold:
            self._bare.ride(draft, self.next_number)
        if draft.carried:
            # Ages, and what the PDU leaves unused, are air, too.
            rest = (room - draft.charged - (unused - draft.room)) / len(draft.carried)
            for message in draft.carried:
                message.owe(rest)
        return self._finish(draft, self.next_number)

    def _next_full(self, start: float, most: int, source: int | None) -> list[BuiltPdu]:
        """Up to `most` next PDUs, if each is filled by one fragment of the same message.

        The PDUs are those that `_next_pdu` would return one by one, without its search for each.
        """
        if source is not None and source != self._src:
            return []
        if self._flush.is_on and self._flush.must_wait(start):
            return []
        level = self._outbox.levels[0]
        lane = level.lanes[0]
        head = lane.current
        if head is None or len(level.lanes) > 1 or not self._single_entry.fills_some(head):
            return []
        if self._live(lane, start) is not head:
            return []
        built = self._single_entry.filled(lane, start, self.next_number, most)
        self.take_number(len(built))
        return built

    def _next_whole(self, level: Level, start: float) -> Outgoing | None:
        """The next message of a level, if it is another robot's PDU."""
        lane = level.lanes[0]
        return self._live(lane, start) if lane.head and lane.head.is_whole else None

    def _live(self, lane: Lane, start: float) -> Outgoing | None:
        """The lane's next message that is still worth sending.

        A head that is pointless to send is rare, so `HeadOfLine` handles that case.
        """
        head = lane.current or (lane.waiting[0] if lane.waiting else None)
        if head is not None and head.in_vain(start, self._patience_s):
            return self._head_of_line.next_live(lane, start)
        return head

    def _finish(self, draft: Draft, number: int) -> BuiltPdu:
        data = draft.build(
            FLAGS[draft.qos, draft.is_compressed], self._src, draft.dst,
            number & 0xFF, self._hop_limit, self._control_entry_id,
        )  # fmt: skip
        if number == self.next_number:
            self.next_number = (number + 1) % PDU_NUMBERS
        self._control_entry_id = (self._control_entry_id + 1) & 0xFF
        return BuiltPdu(data, draft.carried, draft.qos)

    def _fill_from(self, level: Level, draft: Draft, start: float) -> None:
        """Add entries of a level's topics, the one that has sent least first, while they fit."""
        given: set[Lane] = set()
        i = 0
        while i < len(level.lanes) and i <= MAX_LANES_PER_PDU and draft.room > 0:
            lane = level.lanes[i]
            head = self._live(lane, start)
            if head is None:
                continue
            is_due = self._is_greedy or lane not in given
            if (
                is_due
                and draft.suits(head)
                and not head.is_whole
                and self._writer.place(lane, head, level, draft, start)
            ):
                # The lane is behind all that have sent less, so that another one is here now.
                given.add(lane)
            else:
                i += 1
