"""Settings of a GNU Radio flowgraph that replaces modem and radio."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta


class GnuRadioParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A GNU Radio flowgraph as the PHY, which takes and returns PDUs."""

    transport: Literal["zmq-push", "zmq-pub", "udp", "tcp"] = "zmq-push"
    """How PDUs travel: as PMT messages of gr-zeromq, or as octets of a socket_pdu."""
    send: str = ""
    """zmq: endpoint that the daemon binds; udp, tcp: HOST:PORT of the socket_pdu."""
    receive: str = ""
    """zmq: endpoint that the daemon connects to; udp: the daemon's HOST:PORT, empty: PDUs come
    back to the sending port."""
    rate_bit_s: Annotated[float, Meta(gt=0, le=1e12)] = 100e3
    """Rate in bit/s that the flowgraph sustains. Traffic beyond it waits in the daemon's queue, not
    in the flowgraph's."""
    delay_s: Annotated[float, Meta(ge=0, le=10)] = 0.0
    """Delay of a PDU through the flowgraph in s; it becomes part of the messages' age."""
    hear_self: bool = False
    """Whether to accept our own PDUs where the flowgraph returns them."""
