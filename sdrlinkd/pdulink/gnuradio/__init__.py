"""GNU Radio as the PHY; the daemon itself does not need GNU Radio installed."""

from sdrlinkd.config import Config
from sdrlinkd.pdulink.gnuradio.link import GnuRadioLink
from sdrlinkd.pdulink.gnuradio.pdus import from_gnu_radio, to_gnu_radio
from sdrlinkd.pdulink.gnuradio.transport import TcpTransport, Transport, UdpTransport, ZmqTransport


def make_gnuradio(config: Config) -> GnuRadioLink:
    """The GNU Radio link that the configuration describes. Raises UserError."""
    params, pdu_size = config.gnuradio, config.link.pdu_size
    transport: Transport
    if params.transport == "udp":
        transport = UdpTransport(params.send, params.receive)
    elif params.transport == "tcp":
        transport = TcpTransport(params.send, pdu_size)
    else:
        transport = ZmqTransport(params.send, params.receive, params.transport == "zmq-pub")
    return GnuRadioLink(params, pdu_size, transport)


__all__ = ["GnuRadioLink", "from_gnu_radio", "make_gnuradio", "to_gnu_radio"]
