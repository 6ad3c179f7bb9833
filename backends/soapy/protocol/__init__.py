"""What the daemon and its radio process exchange: messages, and samples in shared memory.

This package owns the format of both: control messages, chunks of received samples, and the ring
that holds the samples. It opens no socket and decides nothing: who sends what, and when, is up to
each side.
"""

from backends.soapy.protocol.control import (
    MOST_BYTES,
    Begin,
    Blame,
    CountersReport,
    Failed,
    FromProcess,
    Open,
    Opened,
    TxCommand,
    TxDone,
    Waiting,
    encode,
    from_process,
    to_open,
    to_process,
)
from backends.soapy.protocol.ring import SampleRing, make_shared, ring_sizes
from backends.soapy.protocol.rx_chunk import (
    RX_CHUNK_BYTES,
    GapReason,
    RxChunk,
    pack_rx_chunk,
    unpack_rx_chunk,
)

__all__ = [
    "MOST_BYTES",
    "RX_CHUNK_BYTES",
    "Begin",
    "Blame",
    "CountersReport",
    "Failed",
    "FromProcess",
    "GapReason",
    "Open",
    "Opened",
    "RxChunk",
    "SampleRing",
    "TxCommand",
    "TxDone",
    "Waiting",
    "encode",
    "from_process",
    "make_shared",
    "pack_rx_chunk",
    "ring_sizes",
    "to_open",
    "to_process",
    "unpack_rx_chunk",
]
