"""What hub and radios of an ether say to each other, over ZeroMQ.

A radio's DEALER talks to the hub's ROUTER `air`: it says Hello and gets Welcome or Refused, then
Stretch after Stretch, samples (complex64) in a second frame where there are any. On a socket of its
own it PUSHes to the hub's PULL `sky`: Sent with the samples, Done after each Stretch that asks for
it (lock-step), Bye. All but samples is msgpack.
"""

from collections.abc import Sequence
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from backends.base import Samples
from backends.ether.world import RadioParams

VERSION = 1


class Hello(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """A radio wants to join. `who` names its daemon to people."""

    version: int
    node: Annotated[int, Meta(ge=0, le=254)]
    who: str
    rate_hz: float
    frequency_hz: float


class Welcome(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """It may: its radio, its chance, and how time goes on here."""

    token: int
    radio: RadioParams
    seed: int
    block_s: float
    host_ns: int
    """The time of its index 0 by the monotonic clock."""
    paced: bool
    air: str


class Refused(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """It may not; the reason says what to do."""

    reason: str


class Placed(msgspec.Struct, array_like=True, frozen=True):
    """Burst `number` begins at `start`; None: it came too late."""

    number: int
    start: int | None
    n_samples: int


class Stretch(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """The next `n` samples. `step`: answer with Done(step), and nothing happens until then."""

    n: int
    is_deaf: bool
    host_ns: int
    step: int = 0
    lost: int = 0
    """Samples before these that the hub could not deliver."""
    placed: list[Placed] = []
    notice: str = ""


class Sent(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """A burst, from `start` on, or up to `latest`, by the air's count of this node."""

    token: int
    number: int
    start: int
    latest: int | None
    late_seen: int
    """How many of its bursts the radio knows to have been late."""


class Done(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """All that follows from a step has been done."""

    token: int
    step: int


class Bye(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """The radio is closed and leaves the air."""

    token: int


class Question(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """How goes it? Asked by whoever watches; answered with Answer."""


class Answer(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """The state of the hub, for whoever asks."""

    now_s: float
    nodes: dict[int, str]
    is_over: bool
    bursts: int
    bursts_late: int
    samples_lost: int


ToHub = Hello | Question
FromHub = Welcome | Refused | Stretch | Answer
FromRadio = Sent | Done | Bye

_encoder = msgspec.msgpack.Encoder()
_to_hub: msgspec.msgpack.Decoder[ToHub] = msgspec.msgpack.Decoder(ToHub)
_from_hub: msgspec.msgpack.Decoder[FromHub] = msgspec.msgpack.Decoder(FromHub)
_from_radio: msgspec.msgpack.Decoder[FromRadio] = msgspec.msgpack.Decoder(FromRadio)


def encode(message: msgspec.Struct) -> bytes:
    """The bytes of one message."""
    return _encoder.encode(message)


def to_hub(data: bytes) -> ToHub:
    """What a radio or a watcher says. Raises msgspec.DecodeError."""
    return _to_hub.decode(data)


def from_hub(data: bytes) -> FromHub:
    """What the hub says. Raises msgspec.DecodeError."""
    return _from_hub.decode(data)


def from_radio(data: bytes) -> FromRadio:
    """What a radio sends. Raises msgspec.DecodeError."""
    return _from_radio.decode(data)


def samples_in(frames: Sequence[bytes]) -> Samples | None:
    """The samples behind a message; None when there are none."""
    return np.frombuffer(bytearray(frames[1]), np.complex64) if len(frames) > 1 else None
