"""Parity for large messages, from which receivers compute fragments of lost PDUs.

The code is Reed-Solomon over the fragments, byte by byte (zfec): the j-th byte of every parity
fragment follows from the j-th bytes of all fragments. So parity can be cut into pieces anywhere.
For each piece, any `n` fragments and parity fragments of a message with `n` fragments determine all
others.
"""

import math

import zfec

from sdrlinkd.wire import (
    MAX_CODED,
    MAX_VALUE_SIZE,
    PARITY_OVERHEAD,
    TLV_HEADER_SIZE,
    Parity,
    Partial,
    build_records,
)

LEAST_FRAGMENTS = 4
"""Fewest fragments for which parity is sent."""


def parity_records(
    payload: bytes, k: int, total: int, ids: tuple[int, int], share: float, room: int
) -> list[bytes]:
    """Records with `share` parity fragments per fragment, ordered by position in the fragments.

    `ids` is (topic id, entry id), and `room` is the number of record bytes that fit into a PDU.
    """
    n_parity = min(math.ceil(share * total), MAX_CODED - total)
    if total < LEAST_FRAGMENTS or n_parity < 1:
        return []
    length = _piece(room)
    fragments = [payload[i * k : (i + 1) * k] for i in range(total)]
    fragments[-1] = fragments[-1].ljust(k, b"\0")
    numbers = list(range(total, total + n_parity))
    made = zfec.Encoder(total, total + n_parity).encode(fragments, numbers)
    return [
        build_records(
            [Parity(*ids, total, n_parity, i, at, k, len(payload), each[at : at + length])]
        )
        for at in range(0, k, length)
        for i, each in enumerate(made)
    ]


def parity_pdus(k: int, total: int, share: float, room: int) -> int:
    """How many PDUs the parity of a message takes; arguments as for `parity_records`."""
    n_parity = min(math.ceil(share * total), MAX_CODED - total)
    if total < LEAST_FRAGMENTS or n_parity < 1:
        return 0
    length = _piece(room)
    records = n_parity * -(-k // length)
    return -(-records // (room // (PARITY_OVERHEAD + length)))


def _piece(room: int) -> int:
    """Octets of parity in a record, so that whole records fill a PDU."""
    longest = TLV_HEADER_SIZE + MAX_VALUE_SIZE
    return room // -(-room // longest) - PARITY_OVERHEAD


def is_sound(parity: Parity) -> bool:
    """Whether the fields of a record are consistent."""
    k, total = parity.k, parity.total
    return (
        k * (total - 1) < parity.size <= k * total
        and 0 < len(parity.data) <= k - parity.at
        and parity.number < parity.n_parity <= MAX_CODED - total
    )


def missing_fragments(partial: Partial) -> dict[int, bytes]:
    """The fragments that `partial` lacks, by number, if its parity suffices; else empty."""
    if partial.shape is None:
        return {}
    (n_parity, k, size), total, there = partial.shape, partial.total, partial.parity
    lengths = [k] * (total - 1) + [size - k * (total - 1)]
    lost = [i for i in range(total) if i not in partial.parts]
    if any(len(each) < len(lost) for each in there.values()) or not _covers(there, k):
        return {}
    if any(len(part) != lengths[i] for i, part in partial.parts.items()):
        return {}
    decoder = zfec.Decoder(total, total + n_parity)
    found: dict[int, list[bytes]] = {i: [] for i in lost}
    for at, pieces in sorted(there.items()):
        end = at + len(next(iter(pieces.values())))
        blocks = {i: part[at:end].ljust(end - at, b"\0") for i, part in partial.parts.items()}
        # zfec requires each fragment at its own index, and parity at the missing ones.
        parity = iter(sorted(pieces))
        numbers = [i if i in blocks else total + next(parity) for i in range(total)]
        shares = [blocks[i] if i < total else pieces[i - total] for i in numbers]
        whole = decoder.decode(shares, numbers)
        for i, parts in found.items():
            parts.append(whole[i])
    return {i: b"".join(parts)[: lengths[i]] for i, parts in found.items()}


def _covers(there: dict[int, dict[int, bytes]], k: int) -> bool:
    """Whether the pieces at these offsets together cover a fragment of `k` bytes."""
    end = 0
    for at in sorted(there):
        if at != end:
            return False
        end += len(next(iter(there[at].values())))
    return end == k
