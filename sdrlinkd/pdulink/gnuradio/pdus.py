"""Our PDUs as PDUs of GNU Radio: a pair of metadata, with the paper's names, and octets."""

import time
from typing import Any

from sdrlinkd.pdulink.gnuradio import pmt
from sdrlinkd.wire import HEADER_SIZE


def to_gnu_radio(pdu: bytes) -> bytes:
    """A PDU as a PMT message: src_id, dst_id, seq, t_src_wall (s since 1970), and its octets."""
    meta = {"src_id": pdu[1], "dst_id": pdu[2], "seq": pdu[3], "t_src_wall": time.time_ns() * 1e-9}
    return pmt.dumps(pmt.Pair(meta, pdu))


def from_gnu_radio(data: bytes) -> bytes:
    """The octets of a PMT message, whatever metadata a flowgraph gave it. Raises ValueError."""
    octets: Any = pmt.loads(data)
    if isinstance(octets, pmt.Pair):
        octets = octets.cdr
    if not isinstance(octets, bytes):
        raise ValueError(f"a {type(octets).__name__} instead of a PDU")
    if len(octets) < HEADER_SIZE:
        raise ValueError("a PDU without a header")
    return octets
