"""The PDUs that this robot sent a moment ago, to be sent again."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from sdrlinkd.link.packing import TopicEntryIds
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Outgoing
from sdrlinkd.wire import (
    BROADCAST,
    CONTROL_TOPIC_ID,
    DST,
    HOP,
    PARTS,
    SRC,
    Parity,
    Stamp,
    is_sealed,
    lasting_identity,
    numbered,
    parse,
    postponed,
    read_control_entries,
    with_topic,
)

KEEP_S = 1.0
"""Time in s for which a PDU can be sent again."""
KEEP_BYTES = 1 << 20
"""Memory in octets for these PDUs."""


class Kept(NamedTuple):
    """A PDU that was sent, with its number among those of its source.

    `octets` are those of the air. Those of a relayed PDU are as it came, and count from `first_at`,
    when it came; those of our own count from the preamble of their burst.
    """

    src: int
    number: int
    octets: bytes
    first_at: float
    mcs: int
    qos: Qos
    carried: Sequence[Outgoing]
    fragments: Sequence[tuple[int, int, int]]
    """(topic, entry id, how often the id was taken before) of the fragments of longer messages."""

    @property
    def is_relayed(self) -> bool:
        """Whether another robot is its source."""
        return self.carried[0].is_whole

    @property
    def dst(self) -> int:
        """The robot that it is for."""
        return self.octets[DST]

    def worth_until(self) -> float:
        """When no message in it is worth sending any longer."""
        if len(self.carried) == 1:
            return self.carried[0].worth_until
        return max(message.worth_until for message in self.carried)

    def is_for(self, robot: int) -> bool:
        """Whether a robot may need it: as its destination, or to relay it."""
        return self.dst in (BROADCAST, robot) or self.octets[HOP] >> 4 > 1


class KeptPdus:
    """The PDUs with messages sent in the last second, by source and number."""

    def __init__(self, entry_ids: TopicEntryIds, *, has_numbers: bool) -> None:
        self._entry_ids = entry_ids
        self._has_numbers = has_numbers
        self._kept: dict[tuple[int, int], Kept] = {}
        self._order: deque[Kept] = deque()
        self._n_bytes = 0

    def keep(
        self, number: int, octets: bytes, plain: bytes, mcs: int, qos: Qos,
        carried: Sequence[Outgoing], start: float,
    ) -> Kept:  # fmt: skip
        """Keep a PDU of a burst that left at `start`; `plain` are its octets in the clear."""
        first, fragments = carried[0], []
        if first.is_whole:
            octets, start = first.payload, first.arrived_at
        elif any(message.rests_id for message in carried):
            pdu = parse(plain, len(plain), is_intact=True)
            pdu = numbered(pdu) if self._has_numbers else pdu
            own = {(each.topic_id, each.entry_id) for each in pdu.entries}
            ids = [
                (id_, entry_id)
                for id_, entry_id, _, total, _ in pdu.entries
                if id_ != CONTROL_TOPIC_ID and (total > 1 or id_ == PARTS)
            ]
            for record in map(with_topic, read_control_entries(pdu).records):
                told = isinstance(record, Parity | Stamp) and (record.topic_id, record.entry_id)
                if told and (isinstance(record, Parity) or told not in own):
                    # Parity, or an age that went ahead.
                    ids.append(told)
            fragments = [(*each, self._entry_ids.times_taken(*each)) for each in ids]
        kept = Kept(octets[SRC], number, octets, start, mcs, qos, carried, fragments)
        key = kept.src, number
        if key not in self._kept:
            self._order.append(kept)
            self._n_bytes += len(octets)
        self._kept[key] = kept
        return kept

    def find(self, src: int, number: int) -> Kept | None:
        """A PDU of robot `src`; None if it is not kept (any more)."""
        return self._kept.get((src, number))

    def forget(self, now: float) -> None:
        """Forget what is too old, or too much."""
        order = self._order
        while order and (order[0].first_at < now - KEEP_S or self._n_bytes > KEEP_BYTES):
            oldest = order.popleft()
            del self._kept[oldest.src, oldest.number]
            self._n_bytes -= len(oldest.octets)

    def clear(self) -> None:
        """Forget all, as the clock starts anew."""
        self._kept.clear()
        self._order.clear()
        self._n_bytes = 0

    def forget_source(self, src: int) -> None:
        """Forget the PDUs of a robot that has restarted."""
        if any(key[0] == src for key in self._kept):
            self._kept = {key: each for key, each in self._kept.items() if key[0] != src}
            self._order = deque(each for each in self._order if each.src != src)
            self._n_bytes = sum(len(each.octets) for each in self._order)

    def may_repeat(self, kept: Kept) -> bool:
        """Whether no other message uses an entry id in a PDU by now."""
        return all(
            self._entry_ids.times_taken(channel, entry_id) == taken
            for channel, entry_id, taken in kept.fragments
        )

    def renew_ids(self, kept: Kept, start: float) -> None:
        """Let the entry ids in a PDU rest from `start` on, when it is repeated."""
        for channel, entry_id, _ in kept.fragments:
            self._entry_ids.rest_again(channel, entry_id, start)


def is_lasting(octets: bytes) -> bool:
    """Whether others know a PDU again after its times have grown."""
    if is_sealed(octets):
        return True
    return lasting_identity(postponed(octets, 100_000)) == lasting_identity(octets)
