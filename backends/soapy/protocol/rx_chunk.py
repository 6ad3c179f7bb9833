"""Chunks of what was received: where in the shared memory they lie, or why there are none."""

import struct
from enum import IntEnum
from typing import NamedTuple


class GapReason(IntEnum):
    """Why a chunk has no samples."""

    NONE = 0
    """The chunk has samples: it is no gap."""
    OVERFLOW = 1
    SENDING = 2
    RESTART = 3


class RxChunk(NamedTuple):
    """`n` samples from index `first` on, at `at` of the shared memory; or why there are none.

    `host_ns`: when the last of them was there, by this host's monotonic clock. `uncertainty`: by
    how many samples the index may be wrong. `gap_reason`: a GapReason.
    """

    first: int
    n: int
    at: int
    host_ns: int
    uncertainty: int
    gap_reason: int


_RX_CHUNK = struct.Struct("<qqqqii")
RX_CHUNK_BYTES = _RX_CHUNK.size


def pack_rx_chunk(chunk: RxChunk) -> bytes:
    """A chunk as one message of the receive socket, RX_CHUNK_BYTES long."""
    return _RX_CHUNK.pack(*chunk)


def unpack_rx_chunk(data: bytes) -> RxChunk:
    """The chunk of a message that `pack_rx_chunk` made. Raises struct.error for any other."""
    return RxChunk(*_RX_CHUNK.unpack(data))
