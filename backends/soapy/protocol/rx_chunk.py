"""Chunks of received samples: their place in the shared memory, or why there are none."""

import struct
from enum import IntEnum
from typing import NamedTuple


class GapReason(IntEnum):
    """Why a chunk has no samples."""

    NONE = 0
    """The chunk has samples; it is not a gap."""
    OVERFLOW = 1
    SENDING = 2
    RESTART = 3


class RxChunk(NamedTuple):
    """`n` samples from index `first` on, at position `at` in the shared memory; or a gap.

    `host_ns`: time of the last sample by this host's monotonic clock. `uncertainty`: possible error
    of the index in samples. `gap_reason`: a GapReason.
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
    """Encode a chunk as one message of the receive socket, RX_CHUNK_BYTES long."""
    return _RX_CHUNK.pack(*chunk)


def unpack_rx_chunk(data: bytes) -> RxChunk:
    """Decode a message that `pack_rx_chunk` made. Raises struct.error for any other."""
    return RxChunk(*_RX_CHUNK.unpack(data))
