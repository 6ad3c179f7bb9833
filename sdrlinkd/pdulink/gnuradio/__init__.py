"""GNU Radio as the PHY; the daemon itself does not need GNU Radio installed."""

from sdrlinkd.config import Config
from sdrlinkd.pdulink.gnuradio.link import GnuRadioLink
from sdrlinkd.pdulink.gnuradio.pdus import from_gnu_radio, to_gnu_radio
from sdrlinkd.pdulink.gnuradio.transport import TcpTransport, Transport, UdpTransport, ZmqTransport


def make_gnuradio(config: Config) -> GnuRadioLink:
    """The GNU Radio link that the configuration describes. Raises UserError."""
    return GnuRadioLink(config.gnuradio, config.link.pdu_size, _transport(config))


async def try_gnuradio(config: Config) -> None:
    """Open the sockets of the link that the configuration describes, and close them.

    Raises UserError.
    """
    transport = _transport(config)
    try:
        await transport.open(lambda _: None)
    finally:
        transport.close()


def _transport(config: Config) -> Transport:
    params = config.gnuradio
    if params.transport == "udp":
        return UdpTransport(params.send, params.receive)
    if params.transport == "tcp":
        return TcpTransport(params.send, config.link.pdu_size)
    return ZmqTransport(params.send, params.receive, params.transport == "zmq-pub")


__all__ = ["GnuRadioLink", "from_gnu_radio", "make_gnuradio", "to_gnu_radio", "try_gnuradio"]
