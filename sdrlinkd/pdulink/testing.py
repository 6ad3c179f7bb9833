"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.pdulink.gnuradio import pmt
from sdrlinkd.pdulink.gnuradio.transport import TcpTransport, UdpTransport, ZmqTransport

__all__ = [
    "TcpTransport",
    "UdpTransport",
    "ZmqTransport",
    "pmt",
]
