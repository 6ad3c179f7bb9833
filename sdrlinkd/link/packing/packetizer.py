"""From queued messages to PDUs: the paper's packing policy (section 5.2), class by class.

Among topics of equal class and priority: with two or more pending, PDUs of two entries, a fragment
having k = max(k*(2), k_min) bytes, round robin; with one, a single entry of k = P_max − 13. k
freezes at a message's first fragment. Greedy: further entries of the same topics while they fit.
Lower classes fill what is left over.
"""

from random import Random

from sdrlinkd.link.packing.draft import BuiltPdu, Draft
from sdrlinkd.link.packing.entry_ids import REST_FACTOR, TopicEntryIds
from sdrlinkd.link.packing.flush import Flush
from sdrlinkd.link.packing.head_of_line import HeadOfLine
from sdrlinkd.link.packing.parity import parity_records
from sdrlinkd.link.packing.piggyback import PiggybackRecords
from sdrlinkd.link.packing.single_entry import SingleEntry
from sdrlinkd.link.params import LinkParams
from sdrlinkd.link.qos import WIRE_BITS, Qos
from sdrlinkd.link.queue import Lane, Level, Outbox, Outgoing, with_first
from sdrlinkd.link.schedule import ClassesParams
from sdrlinkd.wire import (
    ASKING_STAMP_SIZE,
    BROADCAST,
    ENTRY_HEADER_SIZE,
    MAX_AGE_US,
    MAX_ENTRIES,
    MAX_FRAGMENTS,
    STAMP_SIZE,
    build_stamp,
    equal_payload,
    flags,
    fragment_count,
)

# Lanes looked at while one PDU is filled; past that the room left is not worth the search.
MAX_LANES_PER_PDU = 4 * MAX_ENTRIES

# Less room for one more entry than this, and a STAMP does not even fit behind other records.
MIN_ROOM_FOR_STAMP = STAMP_SIZE - ENTRY_HEADER_SIZE - 1


class Packetizer:
    """Fills PDUs from the outbox. Chance (sequence start, entry ids) comes from `rng`."""

    def __init__(
        self,
        params: LinkParams,
        src: int,
        outbox: Outbox,
        rng: Random,
        reassembly_timeout_s: float,
        has_control: bool,
        classes: ClassesParams,
    ) -> None:
        self._params = params
        self._pdu_size = params.pdu_size
        self._src = src
        self._has_control = has_control
        self._parity = {qos: classes.of(qos).parity for qos in Qos}
        self._outbox = outbox
        self._seq = rng.randrange(256)
        self._control_entry_id = rng.randrange(256)
        self.entry_ids = TopicEntryIds(rng, REST_FACTOR * reassembly_timeout_s)
        self.k_single = equal_payload(params.pdu_size, 1)
        self._k_shared = min(
            max(equal_payload(params.pdu_size, 2), params.min_fragment), self.k_single
        )
        self.head_of_line = HeadOfLine(outbox, self.entry_ids, reassembly_timeout_s)
        self._single_entry = SingleEntry(outbox, self.head_of_line, params, src, has_control)
        self.piggyback = PiggybackRecords()
        self.asking: list[Outgoing] = []
        """Messages just stamped whose producers want to know what becomes of them."""
        self.flush = Flush(params.flush_s, outbox, self.k_single, reassembly_timeout_s)

    def next_pdu(
        self, start: float, first: Qos | None = None, src: int | None = None
    ) -> BuiltPdu | None:
        """The next PDU of a burst whose preamble leaves at `start`, or None.

        The most urgent comes first, or class `first`; None also where that is not of `src`. What
        is in vain is withdrawn; see `HeadOfLine`.
        """
        levels = self._outbox.levels
        if not levels or self.flush.must_wait(start):
            return None
        may_be_own = src is None or src == self._src
        draft = Draft(self._pdu_size)
        looked_at = 0
        order = levels if first is None else with_first(levels, first)
        for level in tuple(order):
            if draft.is_empty and (whole := self._single_entry.next_whole(level, start)):
                return (
                    self._single_entry.relayed(whole, start) if src in (None, whole.src) else None
                )
            if not may_be_own:
                return None
            looked_at += len(level.lanes)
            if self._may_fit(level, draft.room):
                self._fill_from(level, draft, start)
            if draft.room <= 0 or (looked_at > MAX_LANES_PER_PDU and not draft.is_empty):
                break
        if draft.is_empty:
            return None
        if draft.room >= MIN_ROOM_FOR_STAMP:
            for message in draft.carried:
                if not message.stamped:
                    self._stamp(draft, message, start)
        if self.piggyback and draft.dst == BROADCAST:
            self.piggyback.ride(draft, start)
        return self._finish(draft)

    def next_full(self, start: float, most: int, src: int | None = None) -> list[BuiltPdu]:
        """The next `most` PDUs or fewer, where they are alike: fragments that fill them.

        What `next_pdu` would give one after another, without looking round after each.
        """
        levels = self._outbox.levels
        if not levels or (src is not None and src != self._src):
            return []
        if self.flush.must_wait(start):
            return []
        built = self._single_entry.filled(levels[0], start, self._seq, most)
        self._seq = (self._seq + len(built)) & 0xFF
        return built

    def next_src(self, first: Qos | None = None) -> int:
        """Whose PDU goes next, or next of a class, as far as one can tell."""
        levels = self._outbox.levels if self._outbox.relays else []
        for level in [each for each in levels if first is None or each.key[0] == first][:1]:
            head = level.lanes[0].head
            if head is not None and head.is_whole:
                return head.src
        return self._src

    def records_pdu(self, start: float) -> BuiltPdu | None:
        """A PDU of its own for the offered records, when there are any, in a burst at `start`."""
        draft = Draft(self._pdu_size)
        self.piggyback.ride(draft, start)
        if draft.is_empty:
            return None
        draft.address(BROADCAST, Qos.DEFAULT)
        return self._finish(draft)

    def next_wakeup(self, now: float) -> float:
        """When `next_pdu` may next have something to send; −inf: now; infinity: nothing waits."""
        if not self._outbox:
            return float("inf")
        if self.flush.must_wait(now):
            return self.flush.due_at()
        return min(
            self.entry_ids.next_free(lane.waiting[0]) if lane.current is None else float("-inf")
            for level in self._outbox.levels
            for lane in level.lanes
        )

    def _finish(self, draft: Draft) -> BuiltPdu:
        data = draft.build(
            flags(WIRE_BITS[draft.qos], draft.is_compressed), self._src, draft.dst, self._seq,
            self._params.hop_limit, self._control_entry_id,
        )  # fmt: skip
        self._seq = (self._seq + 1) & 0xFF
        self._control_entry_id = (self._control_entry_id + 1) & 0xFF
        return BuiltPdu(data, draft.carried, draft.qos)

    def _may_fit(self, level: Level, room: int) -> bool:
        """Whether some lane's next entry may fit: a quick no spares the look at each.

        A fragment that is not its message's last has at least k_shared bytes.
        """
        if room >= self._k_shared:
            return True
        for lane in level.lanes:
            head = lane.current or lane.waiting[0]
            if len(head.payload) - head.next_index * head.k <= room:
                return True
        return False

    def _fill_from(self, level: Level, draft: Draft, start: float) -> None:
        lanes = tuple(level.lanes)
        more = True
        while more:
            more = False
            for lane in lanes:
                head = self.head_of_line.live(lane, start)
                if head is None or head.is_whole or not draft.suits(head):
                    continue
                if self._place(lane, head, level, draft, start):
                    more = self._params.greedy
            more = more and draft.room > 0 and self._may_fit(level, draft.room)

    def _place(self, lane: Lane, head: Outgoing, level: Level, draft: Draft, start: float) -> bool:
        """Put the lane's next entry into the draft if it fits."""
        if head.parity:
            return self._place_parity(lane, head, draft, start)
        size = len(head.payload)
        k = head.k or self._fragment_size(size, level.per_dst[lane.dst])
        at = head.next_index * k
        length = min(k, size - at)
        is_last = at + length >= size
        needs_stamp = is_last and not head.stamped
        if needs_stamp and length + bool(head.receipt) > draft.room_beside_stamp:
            # The age goes ahead in a PDU of its own only where even an empty one is too small.
            return draft.is_empty and self._send_stamp_ahead(lane, head, k, draft, start)
        if length > draft.room or not self._begin(lane, head, k, start):
            return False
        payload = head.payload if length == size else head.payload[at : at + length]
        draft.add(head.topic_id, head.entry_id, head.next_index, head.total, payload)
        draft.carried.append(head)
        draft.join(head)
        head.advance(1, start)
        if is_last:
            if needs_stamp:
                self._stamp(draft, head, start)
            head.follow_with(self._parity_of(head))
            self._end(lane, head, start)
        self._outbox.served(lane)
        return True

    def _place_parity(self, lane: Lane, head: Outgoing, draft: Draft, start: float) -> bool:
        """Put parity of the message whose fragments have all gone into the draft, if it fits."""
        records = head.parity
        if head in draft.carried:
            # One PDU must not take both with it.
            return False
        n = len(records)
        while records and draft.add_record(records[-1]):
            head.give_parity()
        if len(records) == n:
            return False
        if head.stamped:
            self._stamp(draft, head, start)
        draft.carried.append(head)
        draft.join(head)
        head.ride()
        self._end(lane, head, start)
        self._outbox.served(lane)
        return True

    def _end(self, lane: Lane, head: Outgoing, start: float) -> None:
        """The message is through, unless parity follows."""
        if not head.parity:
            self.entry_ids.retire(head, start)
            self._outbox.end(lane)

    def _parity_of(self, head: Outgoing) -> list[bytes]:
        """Records, the first one last; beside them the age goes again, in case it was lost, too."""
        share = self._parity[head.qos] * self._has_control
        ids, room = (head.topic_id, head.entry_id), self.k_single - ASKING_STAMP_SIZE
        return parity_records(head.payload, head.k, head.total, ids, share, room)[::-1]

    def _send_stamp_ahead(
        self, lane: Lane, head: Outgoing, k: int, draft: Draft, start: float
    ) -> bool:
        if not self._begin(lane, head, k, start):
            return False
        self._stamp(draft, head, start)
        head.keep_id()
        draft.join(head)
        return True

    def _fragment_size(self, size: int, topics_pending: int) -> int:
        k = self._k_shared if topics_pending >= 2 else self.k_single
        return max(k, fragment_count(size, MAX_FRAGMENTS)) if size > k * MAX_FRAGMENTS else k

    def _begin(self, lane: Lane, head: Outgoing, k: int, start: float) -> bool:
        """Make `head` the message being fragmented; False while the topic has no free id."""
        if lane.current is not None:
            return True
        entry_id = self.entry_ids.take(head.topic_id, start)
        if entry_id is None:
            return False
        self._outbox.begin(lane, entry_id, k, fragment_count(len(head.payload), k), start)
        return True

    def _stamp(self, draft: Draft, message: Outgoing, start: float) -> None:
        age_us = min(max(round((start - message.arrived_at) * 1e6), 0), MAX_AGE_US)
        asks = bool(message.receipt)
        stamp = build_stamp(message.topic_id, message.entry_id, age_us, asks)
        if not draft.add_record(stamp):
            return
        message.stamp()
        if asks and not message.is_expected:
            self.asking.append(message)
