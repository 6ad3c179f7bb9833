"""GNU Radio's flowgraphs in place of a radio."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta


class GnuRadioParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A GNU Radio flowgraph as the PHY: it gets PDUs and gives PDUs."""

    transport: Literal["zmq-push", "zmq-pub", "udp", "tcp"] = "zmq-push"
    """PMT messages of gr-zeromq, or octets of a socket_pdu."""
    send: str = ""
    """zmq: endpoint that we bind; udp, tcp: HOST:PORT of the socket_pdu."""
    receive: str = ""
    """zmq: endpoint that we connect to; udp: HOST:PORT of ours, empty: answers come back."""
    rate_bit_s: Annotated[float, Meta(gt=0, le=1e12)] = 100e3
    """The pace that the flowgraph sustains; what comes faster waits in our queue, not in its."""
    delay_s: Annotated[float, Meta(ge=0, le=10)] = 0.0
    """How long PDUs take through the flowgraph; this becomes part of the messages' age."""
    hear_self: bool = False
    """Take our own PDUs, where the flowgraph sends them back."""
