"""Settings of radios without a device: parts of the configuration, and of scenarios."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Decibel = Annotated[float, Meta(ge=-300, le=300)]


class LoopbackParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of a radio that receives its own signal through the simulated air."""

    hear_self: bool = True
    """Take this robot's own PDUs."""
    paced: bool = True
    """Run in real time; false: as fast as possible."""


class IqFileParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of a radio that plays and writes recordings."""

    receive: str = ""
    """Recording to play, SigMF or raw; empty: none."""
    receive_format: Literal["", "cf32_le", "ci16_le", "ci8", "cu8"] = ""
    """Sample type of `receive`, needed if the recording does not state it."""
    transmit: str = ""
    """SigMF recording to write; empty: none."""
    format: Literal["cf32_le", "ci16_le", "ci8"] = "ci16_le"
    """Sample type of the recording `transmit`."""
    paced: bool = True
    """Run in real time; false: as fast as possible."""
    hear_self: bool = True
    """Take this robot's own PDUs."""
    wait_for_consumer: bool = False
    """Start to play when the first consumer subscribes."""


class EtherParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of a radio on the simulated air of an `sdrlink-ether` hub."""

    dir: str = ""
    """Folder of the hub's sockets, for a hub on this computer: `sdrlink-ether --dir FOLDER`."""
    hub: str = ""
    """HOST:PORT of a hub on another computer, instead of `dir`: `sdrlink-ether --listen`."""


class ZmqParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of samples over ZeroMQ, with a GNU Radio flowgraph or srsRAN's radio as the peer."""

    send: str = ""
    """Endpoint to bind, as GNU Radio's sinks do; a leading @ binds, > connects."""
    receive: str = ""
    """Endpoint to connect to, as GNU Radio's sources do."""
    pattern: Literal["push", "pub", "req"] = "push"
    """PUSH and PULL; PUB and SUB, which drop what a slow peer cannot take; REQ and REP."""
    format: Literal["cf32_le", "ci16_le"] = "cf32_le"
    """Sample type in both directions."""
    lead_s: Annotated[float, Meta(ge=0, le=1)] = 0.02
    """Lead of sending over receiving: what may be in transit through the peer."""
    paced: bool = True
    """The peer keeps real time; while it is away, the local clock sets the pace."""


class JammerParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A signal that disturbs all receivers; frequencies in Hz from the centre, times in s."""

    kind: Literal["tone", "narrow", "sweep", "pulses", "noise"] = "tone"
    """A carrier, noise `width_hz` wide, a carrier that goes through `width_hz` in each `period_s`,
    noise in a share `duty` of each `period_s`, or noise in the whole band."""
    over_noise_db: Decibel = 30.0
    """Its mean power while it sends, over a receiver's noise in the band."""
    offset_hz: Annotated[float, Meta(ge=-1e8, le=1e8)] = 0.0
    """Its middle; a pulse or noise has none."""
    width_hz: Annotated[float, Meta(ge=0, le=2e8)] = 0.0
    """Its width; 0: the whole band."""
    period_s: Annotated[float, Meta(gt=0, le=1e3)] = 0.01
    """Time from sweep to sweep, or from pulse to pulse."""
    duty: Annotated[float, Meta(gt=0, le=1)] = 0.02
    """Share of the period that a pulse takes."""
    times: list[Annotated[list[float], Meta(min_length=2, max_length=2)]] = []
    """When it sends, as [begin, end]; []: always."""
