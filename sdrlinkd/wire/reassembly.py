"""Joins fragments into messages (wire document, section 5.3)."""

from sdrlinkd.wire.declared import PARTS, Part
from sdrlinkd.wire.partials import (
    FRAGMENT_OVERHEAD,
    OVERTAKEN,
    PARTIAL_OVERHEAD,
    Joined,
    Large,
    Lost,
    Partial,
    ReassemblyLimits,
    Source,
)
from sdrlinkd.wire.pdu import Entry
from sdrlinkd.wire.record_types import Parity


class Reassembly:
    """Joins fragments per (source, topic id, entry id), in any order, and ignores duplicates.

    Each source's table is ordered by last activity, the oldest first, so timeouts and evictions
    check only its front. `take_lost` returns the messages that were given up.
    """

    def __init__(self, limits: ReassemblyLimits) -> None:
        self._limits = limits
        self._sources: dict[int, Source] = {}
        # Messages given up and not yet returned by `take_lost`.
        self.lost: list[Lost] = []
        self._next_expiry = float("inf")
        self.held_bytes = 0
        self.held = 0
        self.started = 0
        self.began_at = 0.0
        """Arrival time of the first fragment of the message that `add` returned last."""
        self.pdus = 0, 0
        """Numbers of the first and the last PDU with something of that message."""
        self.is_sealed = False
        """Whether all PDUs with something of that message were sealed."""

    def add(
        self, src: int, entry: Entry, now: float, pdu_number: int = 0, *, is_sealed: bool = False
    ) -> bytes | None:
        """Take one entry, of a PDU that was sealed or not; returns the message if that completes
        it, else None.
        """
        topic_id, entry_id, index, total, payload = entry
        source = self._sources.get(src)
        if total == 1:
            if source is not None and (topic_id, entry_id) in source.partials:
                self._give_up(src, source, (topic_id, entry_id), "rx_partial_superseded")
            self.started += topic_id != PARTS
            self.began_at = now
            self.pdus, self.is_sealed = (pdu_number, pdu_number), is_sealed
            return payload
        if source is None:
            source = self._sources[src] = Source()
        key = (topic_id, entry_id)
        partial = source.partials.get(key)
        if partial is not None:
            # After the timeout, the sender may use the entry id for another message.
            if self._is_silent(partial, now):
                self._give_up(src, source, key, "rx_partial_timeout")
                partial = None
            elif self._is_other_message(partial, entry):
                self._give_up(src, source, key, "rx_partial_superseded")
                partial = None
        if partial is None:
            partial = self._start(source, key, total, now)
            partial.pdus = pdu_number, pdu_number
        elif index in partial.parts:
            return None
        partial.note_pdu(pdu_number, is_sealed=is_sealed)
        if len(partial.parts) == total - 1:
            partial.parts[index] = payload
            self._remove(source, key)
            self.began_at = partial.began_at
            self.pdus, self.is_sealed = partial.pdus, partial.is_sealed
            return b"".join([partial.parts[i] for i in range(total)])
        partial.parts[index] = payload
        self._keep(src, source, key, len(payload), now)
        return None

    def join(self, src: int, entry_id: int, part: Part, now: float) -> Joined | None:
        """Take a whole part of a large message; returns the message if that completes it.

        Must follow the call of `add` that returned the part.
        """
        source = self._sources.get(src)
        if source is None:
            source = self._sources[src] = Source()
        key = (part.topic_id, part.number)
        large = source.large.get(key)
        if large is not None and large.n_parts != part.parts:
            self._give_up_large(src, source, key, "rx_partial_superseded")
            large = None
        if large is None:
            large = source.large[key] = Large(part.parts, self.began_at, now)
            source.cost += PARTIAL_OVERHEAD
            self.held_bytes += PARTIAL_OVERHEAD
            self.held += 1
            self.started += 1
            for (topic_id, _), other in source.large.items():
                # A topic's messages come one after the other, except those of other classes.
                other.is_overtaken |= topic_id == part.topic_id and other is not large
        source.large.move_to_end(key)
        large.touched_at = now
        large.is_sealed = large.is_sealed and self.is_sealed
        if part.part == part.parts - 1:
            large.entry_id = entry_id
        if part.part not in large.parts:
            large.parts[part.part] = part.data
            cost = len(part.data) + FRAGMENT_OVERHEAD
            large.cost += cost
            source.cost += cost
            self.held_bytes += cost
        self._next_expiry = min(self._next_expiry, now + self._limits.timeout_s)
        if len(large.parts) == large.n_parts:
            self._remove_large(source, key)
            self.began_at, self.is_sealed = large.began_at, large.is_sealed
            whole = b"".join([large.parts[i] for i in range(large.n_parts)])
            return Joined(part.topic_id, whole, large.entry_id, part.number)
        self._keep_bounds(src, source)
        return None

    def hold(
        self, src: int, parity: Parity, now: float, pdu_number: int = 0, *, is_sealed: bool = False
    ) -> Partial | None:
        """Keep parity with its incomplete message and return that message.

        None if no such message is held, or if the parity is not new or does not match it.
        """
        source, key = self._sources.get(src), (parity.topic_id, parity.entry_id)
        partial = None if source is None else source.partials.get(key)
        if source is None or partial is None or self._is_silent(partial, now):
            return None
        shape = (parity.n_parity, parity.k, parity.size)
        pieces = partial.parity.get(parity.at, {})
        if (
            partial.total != parity.total
            or partial.shape not in (None, shape)
            or parity.number in pieces
            or any(len(each) != len(parity.data) for each in pieces.values())
        ):
            return None
        partial.shape = shape
        partial.note_pdu(pdu_number, is_sealed=is_sealed)
        partial.parity.setdefault(parity.at, pieces)[parity.number] = parity.data
        self._keep(src, source, key, len(parity.data), now)
        return source.partials.get(key)

    def expire(self, now: float) -> None:
        """Give up messages without a new fragment for the timeout."""
        if now < self._next_expiry:
            return
        self._next_expiry = float("inf")
        for src, source in list(self._sources.items()):
            while source.partials:
                key, partial = next(iter(source.partials.items()))
                if not self._is_silent(partial, now):
                    due = partial.touched_at + self._limits.timeout_s
                    self._next_expiry = min(self._next_expiry, due)
                    break
                self._give_up(src, source, key, "rx_partial_timeout")
            for large_key, large in list(source.large.items()):
                due = max(large.touched_at, source.parts_at) + self._limits.timeout_s
                if large.is_overtaken:
                    due = min(due, large.touched_at + OVERTAKEN * self._limits.timeout_s)
                if now < due:
                    self._next_expiry = min(self._next_expiry, due)
                else:
                    self._give_up_large(src, source, large_key, "rx_part_lost")
            if not source.partials and not source.large:
                del self._sources[src]

    def holds(self, src: int, topic_id: int, entry_id: int) -> bool:
        """Whether fragments of a message are held, or the last part of a large one."""
        source = self._sources.get(src)
        if source is None:
            return False
        if (topic_id, entry_id) in source.partials:
            return True
        return topic_id == PARTS and any(
            large.entry_id == entry_id for large in source.large.values()
        )

    def forget(self, src: int) -> None:
        """Give up all that is held of a source that has restarted and numbers messages anew."""
        source = self._sources.pop(src, None)
        if source is not None:
            for key in list(source.partials):
                self._give_up(src, source, key, "rx_partial_superseded")
            for key in list(source.large):
                self._give_up_large(src, source, key, "rx_partial_superseded")

    def take_lost(self) -> list[Lost]:
        """The messages given up since the last call."""
        lost, self.lost = self.lost, []
        return lost

    def _keep(
        self, src: int, source: Source, key: tuple[int, int], n_bytes: int, now: float
    ) -> None:
        """Note that `n_bytes` came for an incomplete message, and enforce the memory limits."""
        partial = source.partials[key]
        partial.touched_at = now
        if key[0] == PARTS:
            source.parts_at = now
        source.partials.move_to_end(key)
        cost = n_bytes + FRAGMENT_OVERHEAD
        partial.cost += cost
        source.cost += cost
        self.held_bytes += cost
        self._keep_bounds(src, source)

    def _start(self, source: Source, key: tuple[int, int], total: int, now: float) -> Partial:
        partial = source.partials[key] = Partial(total, now, now)
        source.cost += PARTIAL_OVERHEAD
        self.held_bytes += PARTIAL_OVERHEAD
        # Parts count once their message is known: as one message.
        self.held += key[0] != PARTS
        self.started += key[0] != PARTS
        self._next_expiry = min(self._next_expiry, now + self._limits.timeout_s)
        return partial

    def _is_silent(self, partial: Partial, now: float) -> bool:
        return now >= partial.touched_at + self._limits.timeout_s

    @staticmethod
    def _is_other_message(partial: Partial, entry: Entry) -> bool:
        known = partial.parts.get(entry.index)
        return partial.total != entry.total or (known is not None and known != entry.payload)

    def _keep_bounds(self, src: int, source: Source) -> None:
        while source.cost > self._limits.source_bytes:
            self._give_up_oldest(src, source, "rx_partial_evicted")
        while self.held_bytes > self._limits.total_bytes:
            greedy = max(self._sources, key=lambda s: self._sources[s].cost)
            self._give_up_oldest(greedy, self._sources[greedy], "rx_partial_memory")

    def _give_up_oldest(self, src: int, source: Source, reason: str) -> None:
        """Give up what has been silent for longest: a message, a part, or a large message."""
        partial = next(iter(source.partials.items()), None)
        large = next(iter(source.large.items()), None)
        if large is not None and (partial is None or large[1].touched_at < partial[1].touched_at):
            self._give_up_large(src, source, large[0], reason)
        elif partial is not None:
            self._give_up(src, source, partial[0], reason)

    def _give_up(self, src: int, source: Source, key: tuple[int, int], reason: str) -> None:
        self._remove(source, key)
        self.lost.append(Lost(src, key[0], key, "rx_part_lost" if key[0] == PARTS else reason))

    def _give_up_large(self, src: int, source: Source, key: tuple[int, int], reason: str) -> None:
        large = self._remove_large(source, key)
        self.lost.append(Lost(src, key[0], (PARTS, large.entry_id), reason))

    def _remove_large(self, source: Source, key: tuple[int, int]) -> Large:
        large = source.large.pop(key)
        source.cost -= large.cost
        self.held_bytes -= large.cost
        self.held -= 1
        return large

    def _remove(self, source: Source, key: tuple[int, int]) -> None:
        partial = source.partials.pop(key)
        source.cost -= partial.cost
        self.held_bytes -= partial.cost
        self.held -= key[0] != PARTS
