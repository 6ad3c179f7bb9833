"""What daemon and radio process tell each other: messages here, samples in shared memory."""

import struct
from enum import Enum, IntEnum
from typing import NamedTuple

import msgspec

from backends.base import AbsentError, BackendError, Patience, RefusalError
from backends.soapy.settings import Found, SoapySettings

MOST_BYTES = 1 << 16


class Open(msgspec.Struct, frozen=True, tag="open"):
    """The first message to the process."""

    settings: SoapySettings
    rx_samples: int
    """Of the shared memory."""
    tx_samples: int
    patience: Patience = Patience.NONE


class Begin(msgspec.Struct, frozen=True, tag="begin"):
    """Receive from now on."""


class Order(msgspec.Struct, frozen=True, tag="order"):
    """Send `n` samples that lie at `at`, from index `start` on, or at the latest from `latest`."""

    number: int
    start: int
    n: int
    at: int
    latest: int | None


class Opened(msgspec.Struct, frozen=True, tag="opened"):
    """It streams."""

    found: Found


class Blame(Enum):
    """Why a device does not stream."""

    ABSENT = "absent"
    """It is not there, in use, or went away."""
    SETTINGS = "settings"
    """It does not take them."""
    HOST = "host"
    """SoapySDR or the device's driver is not installed."""


_ERRORS = {Blame.ABSENT: AbsentError, Blame.SETTINGS: RefusalError, Blame.HOST: BackendError}


class Waiting(msgspec.Struct, frozen=True, tag="waiting"):
    """It looks for its device, which is not there; `reason` where that is another than before.

    Said again and again: a process that does not hangs.
    """

    reason: str = ""


class Failed(msgspec.Struct, frozen=True, tag="failed"):
    """It does not stream, or not any more; the process ends."""

    reason: str
    blame: Blame = Blame.ABSENT

    def error(self) -> BackendError:
        """For whoever wanted it open."""
        return _ERRORS[self.blame](self.reason)


class Left(msgspec.Struct, frozen=True, tag="left"):
    """What became of an order: `outcome` by name of TxOutcome."""

    number: int
    outcome: str
    start: int
    end: int


class Counted(msgspec.Struct, frozen=True, tag="counted"):
    """What the process has counted so far."""

    counters: dict[str, int]
    notice: str = ""


FromProcess = Opened | Waiting | Failed | Left | Counted
encode = msgspec.msgpack.Encoder().encode
to_open = msgspec.msgpack.Decoder(Open).decode
_wish = msgspec.msgpack.Decoder(Begin | Order)
_answer = msgspec.msgpack.Decoder(FromProcess)


def to_process(data: bytes) -> Begin | Order:
    """What the daemon wants, once the device is open."""
    told: Begin | Order = _wish.decode(data)
    return told


def from_process(data: bytes) -> FromProcess:
    """What the process says."""
    told: FromProcess = _answer.decode(data)
    return told


class Why(IntEnum):
    """Of a stretch without samples."""

    HEARD = 0
    OVERFLOW = 1
    SENDING = 2
    RESTART = 3


class Stretch(NamedTuple):
    """`n` samples from `first` on, at `at` of the shared memory; or why there are none."""

    first: int
    n: int
    at: int
    host_ns: int
    uncertainty: int
    why: int


_STRETCH = struct.Struct("<qqqqii")
STRETCH_BYTES = _STRETCH.size


def pack_stretch(stretch: Stretch) -> bytes:
    """For the air socket, one message each."""
    return _STRETCH.pack(*stretch)


def unpack_stretch(data: bytes) -> Stretch:
    """The reverse."""
    return Stretch(*_STRETCH.unpack(data))
