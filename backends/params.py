"""What a person sets of radios without a device: sections of a configuration."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta


class LoopbackParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A radio that hears itself through the simulated air."""

    hear_self: bool = True
    paced: bool = True
    """In real time, or as fast as it goes."""


class IqFileParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A radio that is a recording."""

    receive: str = ""
    """Recording to play, SigMF or raw; empty: none."""
    receive_format: Literal["", "cf32_le", "ci16_le", "ci8", "cu8"] = ""
    """Sample type of `receive` where it does not tell itself."""
    transmit: str = ""
    """SigMF recording to write; empty: none."""
    format: Literal["cf32_le", "ci16_le", "ci8"] = "ci16_le"
    """Sample type of the recording `transmit`."""
    paced: bool = True
    """In real time, or as fast as it goes."""
    hear_self: bool = True
    wait_for_consumer: bool = False
    """Begin to play when the first consumer subscribes."""


class EtherParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A radio on the simulated air of an `sdrlink-ether` hub."""

    dir: str = ""
    """Folder of the hub's sockets, for a hub on this computer: `sdrlink-ether --dir FOLDER`."""
    hub: str = ""
    """HOST:PORT of a hub on another computer, instead of `dir`: `sdrlink-ether --listen`."""


class ZmqParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Samples over ZeroMQ: a GNU Radio flowgraph, or srsRAN's radio, as the radio or the air."""

    send: str = ""
    """Endpoint that we bind, as GNU Radio's sinks do; @ before it binds, > connects."""
    receive: str = ""
    """Endpoint that we connect to, as GNU Radio's sources do."""
    pattern: Literal["push", "pub", "req"] = "push"
    """PUSH and PULL; PUB and SUB, which drops what a slow peer cannot take; REQ and REP."""
    format: Literal["cf32_le", "ci16_le"] = "cf32_le"
    lead_s: Annotated[float, Meta(ge=0, le=1)] = 0.02
    """We send so far ahead of what we receive: what may be under way through the peer."""
    paced: bool = True
    """The peer keeps real time; while it is away, the clock does."""
