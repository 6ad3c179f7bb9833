"""One PDU while it is being filled."""

from collections.abc import Mapping
from typing import NamedTuple

from sdrlinkd.link.packing.entry_ids import TopicEntryIds
from sdrlinkd.link.packing.parity import parity_records
from sdrlinkd.link.qos import WIRE_BITS, Qos
from sdrlinkd.link.queue import Lane, Level, Outbox, Outgoing
from sdrlinkd.wire import (
    ASKING_STAMP_SIZE,
    MAX_AGE_US,
    MAX_FRAGMENTS,
    PART_PARITY,
    PARTS,
    PduBuilder,
    flags,
    fragment_count,
    octet,
)

NO_DST = -1
FLAGS = {(qos, z): flags(WIRE_BITS[qos], z) for qos in Qos for z in (False, True)}
"""A PDU's first octet, by (class, whether its messages are compressed)."""


class BuiltPdu(NamedTuple):
    """A finished PDU, the messages of its entries, and the most urgent class inside."""

    data: bytes
    carried: list[Outgoing]
    qos: Qos

    @property
    def src(self) -> int:
        """Id of the PDU's source robot."""
        return self.data[1]


class Draft(PduBuilder):
    """A PDU being filled, with the common properties of its entries and their messages.

    `dst` is NO_DST until it holds something of a message: an entry, a STAMP, or parity.
    """

    __slots__ = ("carried", "charged", "dst", "is_compressed", "level_key", "qos")

    def __init__(self, pdu_size: int) -> None:
        super().__init__(pdu_size)
        self.carried: list[Outgoing] = []
        self.charged = 0
        """Octets of it that topics were charged for."""
        self.level_key: tuple[int, int] | None = None
        """The level of the topic that was charged last."""
        self.dst = NO_DST
        self.is_compressed = False
        self.qos = Qos.BULK

    def suits(self, message: Outgoing) -> bool:
        """Whether entries of `message` may join the entries already in the PDU."""
        return self.dst == NO_DST or (
            self.dst == message.dst and self.is_compressed == message.is_compressed
        )

    def address(self, dst: int, qos: Qos) -> None:
        """Set destination and class of a PDU that holds only control records."""
        self.dst, self.qos = dst, qos

    def take(self, message: Outgoing, payload: bytes) -> None:
        """Add `payload`, the next fragment of `message`."""
        self.add(message.channel, message.entry_id, message.next_index, message.total, payload)
        self.carried.append(message)
        self.join(message)

    def join(self, message: Outgoing) -> None:
        """Note that the PDU holds an entry of `message`, or the STAMP sent ahead of one."""
        self.dst = message.dst
        self.is_compressed = message.is_compressed
        if message.qos < self.qos:
            self.qos = message.qos


class EntryWriter:
    """Cuts a lane's next message into entries and puts them into a draft, with the message's age.

    `parity` is the number of parity fragments per fragment of a large message, by class. `k_single`
    and `k_shared` are the payload bytes of an entry alone in a PDU and of one that shares a PDU.
    """

    def __init__(
        self, outbox: Outbox, entry_ids: TopicEntryIds, k_single: int, k_shared: int,
        parity: Mapping[Qos, float],
    ) -> None:  # fmt: skip
        self._outbox = outbox
        self._entry_ids = entry_ids
        self._k_single = k_single
        self._k_shared = k_shared
        self._parity = parity
        self.asking: list[Outgoing] = []
        """Messages just stamped whose producers want receipts."""

    def leave_room(self, k_single: int, k_shared: int) -> None:
        """Cut messages that begin from now on into fragments of these sizes."""
        self._k_single, self._k_shared = k_single, k_shared

    def may_fit(self, level: Level, room: int) -> bool:
        """Whether the next entry of any lane may fit; a quick no saves trying each lane.

        Every fragment but a message's last has at least k_shared bytes.
        """
        if room >= self._k_shared or room <= 0:
            return room > 0
        for lane in level.lanes:
            head = lane.current or lane.waiting[0]
            if len(head.body) - head.next_index * head.k <= room:
                return True
        return False

    def place(self, lane: Lane, head: Outgoing, level: Level, draft: Draft, start: float) -> bool:
        """Put the lane's next entry into the draft if it fits."""
        if head.parity:
            return self._place_parity(lane, head, draft, start)
        size = len(head.body)
        k = head.k or self._fragment_size(head, level.per_dst[lane.dst])
        at = head.next_index * k
        length = min(k, size - at)
        is_last = at + length >= size
        needs_stamp = is_last and not head.stamped
        beside = head.overhead
        if needs_stamp and length + beside + bool(head.receipt) > draft.room_beside_stamp:
            # Send the age ahead in its own PDU only if both do not fit even into an empty one.
            return draft.dst == NO_DST and self._send_stamp_ahead(lane, head, k, draft, start)
        if length + beside > draft.room or not self._has_begun(lane, head, k, start):
            return False
        draft.take(head, head.body if length == size else head.body[at : at + length])
        head.advance(1, start)
        if is_last:
            if needs_stamp:
                self.stamp(draft, head, start)
            if self._parity[head.qos] or head.channel == PARTS:
                head.follow_with(self._parity_of(head))
            self._end(lane, head, start)
        self._charge(lane, draft, length + beside)
        return True

    def _charge(self, lane: Lane, draft: Draft, octets: int) -> None:
        """Charge a lane's topic for an entry; behind the first of its level, it fills the PDU."""
        fills = lane.level_key == draft.level_key
        draft.charged += octets
        draft.level_key = lane.level_key
        self._outbox.served(lane, octets, fills=fills)

    def _place_parity(self, lane: Lane, head: Outgoing, draft: Draft, start: float) -> bool:
        """Add parity of `head`, whose fragments have all been composed, to the draft if it fits."""
        records, room = head.parity, draft.room
        if head in draft.carried:
            # Loss of one PDU must not take both a fragment and its parity.
            return False
        n = len(records)
        while records and draft.add_record(records[-1]):
            head.give_parity()
        if len(records) == n:
            return False
        if head.stamped and not head.parts_left:
            self.stamp(draft, head, start)
        draft.carried.append(head)
        draft.join(head)
        head.ride()
        self._end(lane, head, start)
        self._charge(lane, draft, room - draft.room)
        return True

    def _end(self, lane: Lane, head: Outgoing, start: float) -> None:
        """End the message, unless parity or another part follows."""
        if not head.parity:
            self._entry_ids.retire(head, start)
            if not head.go_on():
                self._outbox.end(lane)

    def _parity_of(self, head: Outgoing) -> list[bytes]:
        """The parity records of `head` in reverse order, sized to leave room for its age again."""
        ids, room = (octet(head.channel), head.entry_id), self._k_single - ASKING_STAMP_SIZE
        share = self._parity[head.qos]
        if head.channel == PARTS:
            share = max(PART_PARITY, share)
        return parity_records(head.body, head.k, head.total, ids, share, room)[::-1]

    def _send_stamp_ahead(
        self, lane: Lane, head: Outgoing, k: int, draft: Draft, start: float
    ) -> bool:
        if not self._has_begun(lane, head, k, start):
            return False
        self.stamp(draft, head, start)
        head.keep_id()
        draft.join(head)
        return True

    def _fragment_size(self, message: Outgoing, topics_pending: int) -> int:
        size, own = len(message.body), message.overhead
        if message.channel == PARTS:
            # Full PDUs, so that a part and its parity are at most 256 fragments.
            return self._k_single - own
        k = (self._k_shared if topics_pending >= 2 else self._k_single) - own
        return max(k, fragment_count(size, MAX_FRAGMENTS)) if size > k * MAX_FRAGMENTS else k

    def _has_begun(self, lane: Lane, head: Outgoing, k: int, start: float) -> bool:
        """Make `head` the lane's current message, and cut its next part, if that is not done.

        Returns False while the topic has no free entry id.
        """
        if lane.current is not None and not head.needs_id:
            return True
        entry_id = self._entry_ids.take(head, start)
        if entry_id is None:
            return False
        size = len(head.body)
        total = 1 if size <= k else fragment_count(size, k)
        if lane.current is None:
            self._outbox.begin(lane, entry_id, k, total, start)
        else:
            head.cut(entry_id, k, total, start)
        return True

    def stamp(self, draft: Draft, message: Outgoing, start: float) -> None:
        """Add the message's age to `draft` if it fits."""
        age_us = min(max(round((start - message.arrived_at) * 1e6), 0), MAX_AGE_US)
        asks = bool(message.receipt)
        if not draft.add_stamp(message.channel, message.entry_id, age_us, asks):
            return
        message.stamp()
        if asks and not message.is_expected:
            self.asking.append(message)
