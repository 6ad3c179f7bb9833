"""Messages between the hub of an ether and its radios, over ZeroMQ.

A radio's DEALER talks to the hub's ROUTER `air`. It sends Hello and receives Welcome or Refused. In
lock-step it then receives one Stretch after another, with samples (complex64) in a second frame if
there are any. In real time it makes its samples itself, and receives an Arriving, with samples, for
each burst of another radio, and News of its own. On a second socket the radio PUSHes to the hub's
PULL `sky`: Sent with the samples, Done after each Stretch that requests it (lock-step), and Bye.
Everything but samples is msgpack.
"""

from collections.abc import Sequence
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta

from backends.base import Samples
from backends.ether.way import Way
from backends.ether.world import RadioParams
from backends.params import JammerParams

VERSION = 2


class Hello(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """A radio's request to join; `who` names its daemon to people."""

    version: int
    node: Annotated[int, Meta(ge=0, le=254)]
    who: str
    rate_hz: float
    frequency_hz: float


class Welcome(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """The radio may join: its parameters, its seed, and the pace of this air."""

    token: int
    radio: RadioParams
    seed: int
    block_s: float
    host_ns: int
    """Monotonic time of the radio's index 0."""
    paced: bool
    air: str
    jammers: list[JammerParams] = []


class Refused(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """The radio may not join; the reason says what to do."""

    reason: str


class Placed(msgspec.Struct, array_like=True, frozen=True):
    """Burst `number` starts at `start`; None: it came too late."""

    number: int
    start: int | None
    n_samples: int


class Stretch(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """The next `n` samples in lock-step; with a `step`, the air waits for Done(step)."""

    n: int
    is_deaf: bool
    step: int = 0
    placed: list[Placed] = []
    notice: str = ""


class Arriving(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """A burst of node `sender` arrives at index `at`, as it was sent; `way` changes it."""

    sender: int
    at: int
    way: Way


class News(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """Where the radio's own bursts were placed, or a notice for people."""

    placed: list[Placed] = []
    notice: str = ""


class Sent(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """A burst to send at `start`, at the latest at `latest`, in the air's count of this node."""

    token: int
    number: int
    start: int
    latest: int | None
    late_seen: int
    """Number of the radio's bursts that it knows were late."""


class Done(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """All work that follows from a step is done."""

    token: int
    step: int


class Bye(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """The radio is closed and leaves the air."""

    token: int


class Question(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """A request for the hub's state; answered with Answer."""


class Answer(msgspec.Struct, tag=True, frozen=True, kw_only=True):
    """The state of the hub, for anyone who requests it."""

    now_s: float
    nodes: dict[int, str]
    is_over: bool
    bursts: int
    bursts_late: int
    bursts_lost: int
    """Bursts for radios that did not read what the hub sent them."""
    paced: bool = True
    """Whether this air keeps real time; false: lock-step."""
    host_ns: int = 0
    """Monotonic time of the answer."""


ToHub = Hello | Question
FromHub = Welcome | Refused | Stretch | Arriving | News | Answer
FromRadio = Sent | Done | Bye

_encoder = msgspec.msgpack.Encoder()
_to_hub: msgspec.msgpack.Decoder[ToHub] = msgspec.msgpack.Decoder(ToHub)
_from_hub: msgspec.msgpack.Decoder[FromHub] = msgspec.msgpack.Decoder(FromHub)
_from_radio: msgspec.msgpack.Decoder[FromRadio] = msgspec.msgpack.Decoder(FromRadio)


def encode(message: msgspec.Struct) -> bytes:
    """Encode one message."""
    return _encoder.encode(message)


def to_hub(data: bytes) -> ToHub:
    """Decode a message from a radio or a watcher. Raises msgspec.DecodeError."""
    return _to_hub.decode(data)


def from_hub(data: bytes) -> FromHub:
    """Decode a message from the hub. Raises msgspec.DecodeError."""
    return _from_hub.decode(data)


def from_radio(data: bytes) -> FromRadio:
    """Decode a message from a radio. Raises msgspec.DecodeError."""
    return _from_radio.decode(data)


def samples_in(frames: Sequence[bytes]) -> Samples | None:
    """The samples that follow a message; None if there are none."""
    return np.frombuffer(bytearray(frames[1]), np.complex64) if len(frames) > 1 else None
