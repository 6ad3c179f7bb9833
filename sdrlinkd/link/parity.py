"""Parity for large messages: what a lost PDU took can be computed from the others.

A Reed-Solomon code over the fragments, byte by byte (zfec): the j-th byte of every parity fragment
follows from the j-th bytes of all fragments. So parity can be cut into pieces at will; any `n` of
fragments and parity fragments tell all others, for each piece apart.
"""

import math
from collections import OrderedDict
from dataclasses import dataclass, field

import zfec

from sdrlinkd.wire import (
    MAX_VALUE_SIZE,
    PARITY_OVERHEAD,
    TLV_HEADER_SIZE,
    Entry,
    Parity,
    Partial,
    build_records,
)

MOST = 256
"""Fragments and parity fragments of a message."""
LEAST_FRAGMENTS = 4
"""Fewer are not worth it."""
RECORD_OVERHEAD = 128
"""What keeping a record costs beside its octets."""
KEPT_BYTES = 4 << 20
"""Parity that waits for its message, all sources together."""


def parity_records(
    payload: bytes, k: int, total: int, ids: tuple[int, int], share: float, room: int
) -> list[bytes]:
    """Records for `share` times as many parity fragments, those of a place one after the other.

    `ids`: (topic id, entry id). `room`: bytes of records that a PDU holds.
    """
    n_parity = min(math.ceil(share * total), MOST - total)
    if total < LEAST_FRAGMENTS or n_parity < 1:
        return []
    fragments = [payload[i * k : (i + 1) * k] for i in range(total)]
    fragments[-1] = fragments[-1].ljust(k, b"\0")
    numbers = list(range(total, total + n_parity))
    made = zfec.Encoder(total, total + n_parity).encode(fragments, numbers)
    # So long that a PDU is filled by whole records.
    longest = TLV_HEADER_SIZE + MAX_VALUE_SIZE
    length = room // -(-room // longest) - PARITY_OVERHEAD
    return [
        build_records(
            [Parity(*ids, total, n_parity, i, at, k, len(payload), each[at : at + length])]
        )
        for at in range(0, k, length)
        for i, each in enumerate(made)
    ]


@dataclass(slots=True)
class _Known:
    """Parity of one message: by place, what is there by number."""

    shape: tuple[int, int, int, int]
    places: dict[int, dict[int, bytes]] = field(default_factory=dict)
    n_bytes: int = 0

    @property
    def is_whole(self) -> bool:
        """Whether the places cover a fragment."""
        end = 0
        for at in sorted(self.places):
            if at != end:
                return False
            end += len(next(iter(self.places[at].values())))
        return end == self.shape[2]


class Repair:
    """Puts parity and fragments together. Keeps no more than KEPT_BYTES, the newest."""

    def __init__(self) -> None:
        self._known: OrderedDict[tuple[int, int, int], _Known] = OrderedDict()
        self.held_bytes = 0
        self.repaired = 0
        """Fragments that were computed."""

    def take(self, src: int, parity: Parity) -> None:
        """Keep what a record tells; one that contradicts itself, or others, is no use."""
        k, size, total, data = parity.k, parity.size, parity.total, parity.data
        fits = k * (total - 1) < size <= k * total and 0 < len(data) <= k - parity.at
        if not fits or parity.number >= parity.n_parity or total + parity.n_parity > MOST:
            return
        key, shape = (src, parity.topic_id, parity.entry_id), (total, parity.n_parity, k, size)
        known = self._known.get(key)
        if known is not None and known.shape != shape:
            self.forget(*key)
            known = None
        if known is None:
            known = self._known[key] = _Known(shape)
        place = known.places.setdefault(parity.at, {})
        if parity.number in place or any(len(each) != len(data) for each in place.values()):
            return
        place[parity.number] = data
        known.n_bytes += len(data) + RECORD_OVERHEAD
        self.held_bytes += len(data) + RECORD_OVERHEAD
        while self.held_bytes > KEPT_BYTES:
            self.forget(*next(iter(self._known)))

    def missing(self, src: int, topic_id: int, entry_id: int, partial: Partial) -> list[Entry]:
        """The fragments that `partial` lacks, if there is parity enough; else nothing."""
        known = self._known.get((src, topic_id, entry_id))
        if known is None or partial.total != known.shape[0]:
            return []
        total, n_parity, _, _ = known.shape
        lost = [i for i in range(total) if i not in partial.parts]
        if any(len(each) < len(lost) for each in known.places.values()) or not known.is_whole:
            return []
        if any(len(part) != _length(i, known.shape) for i, part in partial.parts.items()):
            return []
        decoder = zfec.Decoder(total, total + n_parity)
        found: list[list[bytes]] = [[] for _ in lost]
        for at, there in sorted(known.places.items()):
            end = at + len(next(iter(there.values())))
            blocks = {i: part[at:end].ljust(end - at, b"\0") for i, part in partial.parts.items()}
            # As the library wants them: a fragment in its own place, parity in the others'.
            parity = iter(sorted(there))
            numbers = [i if i in blocks else total + next(parity) for i in range(total)]
            shares = [blocks[i] if i < total else there[i - total] for i in numbers]
            whole = decoder.decode(shares, numbers)
            for i, number in enumerate(lost):
                found[i].append(whole[number])
        self.repaired += len(lost)
        return [
            Entry(
                topic_id, entry_id, number, total, b"".join(parts)[: _length(number, known.shape)]
            )
            for number, parts in zip(lost, found, strict=True)
        ]

    def forget(self, src: int, topic_id: int, entry_id: int) -> None:
        """Its message is complete, or given up."""
        known = self._known.pop((src, topic_id, entry_id), None)
        if known is not None:
            self.held_bytes -= known.n_bytes


def _length(number: int, shape: tuple[int, int, int, int]) -> int:
    total, _, k, size = shape
    return k if number < total - 1 else size - k * (total - 1)
