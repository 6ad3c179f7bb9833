"""Messages of the control socket between daemon and radio process."""

from enum import Enum

import msgspec

from backends.base import AbsentError, BackendError, Patience, RefusalError
from backends.soapy.settings import DeviceInfo, SoapySettings

MOST_BYTES = 1 << 16


class Open(msgspec.Struct, frozen=True, tag="open"):
    """The first message to the process: the device and its settings."""

    settings: SoapySettings
    rx_samples: int
    """Capacity of the shared memory for receiving, in samples."""
    tx_samples: int
    """Capacity of the shared memory for sending, in samples."""
    patience: Patience = Patience.NONE


class Begin(msgspec.Struct, frozen=True, tag="begin"):
    """The daemon wants samples from now on."""


class TxCommand(msgspec.Struct, frozen=True, tag="tx"):
    """Send the `n` samples at position `at` at index `start`, at the latest at `latest`."""

    number: int
    start: int
    n: int
    at: int
    latest: int | None


class Opened(msgspec.Struct, frozen=True, tag="opened"):
    """The device is open and accepts its settings."""

    found: DeviceInfo


class Blame(Enum):
    """Why a device does not stream."""

    ABSENT = "absent"
    """The device is not present, is in use, or has gone."""
    SETTINGS = "settings"
    """The device is present but rejects its settings."""
    HOST = "host"
    """SoapySDR or the device's driver is not installed."""


_ERRORS = {Blame.ABSENT: AbsentError, Blame.SETTINGS: RefusalError, Blame.HOST: BackendError}


class Waiting(msgspec.Struct, frozen=True, tag="waiting"):
    """The process waits for an absent device; `reason` is set when it differs from the last one.

    The process repeats this message; if it stops, it hangs.
    """

    reason: str = ""


class Failed(msgspec.Struct, frozen=True, tag="failed"):
    """The device does not stream, or no longer does; the process ends."""

    reason: str
    blame: Blame = Blame.ABSENT

    def error(self) -> BackendError:
        """The error to raise in the code that wanted the device open."""
        return _ERRORS[self.blame](self.reason)


class TxDone(msgspec.Struct, frozen=True, tag="tx_done"):
    """What became of a TxCommand; `outcome` is the name of a TxOutcome."""

    number: int
    outcome: str
    start: int
    end: int


class CountersReport(msgspec.Struct, frozen=True, tag="counters"):
    """What the process has counted so far."""

    counters: dict[str, int]
    notice: str = ""


FromProcess = Opened | Waiting | Failed | TxDone | CountersReport
encode = msgspec.msgpack.Encoder().encode
to_open = msgspec.msgpack.Decoder(Open).decode
_to_process = msgspec.msgpack.Decoder(Begin | TxCommand)
_from_process = msgspec.msgpack.Decoder(FromProcess)


def to_process(data: bytes) -> Begin | TxCommand:
    """Decode a message from the daemon, once the device is open."""
    told: Begin | TxCommand = _to_process.decode(data)
    return told


def from_process(data: bytes) -> FromProcess:
    """Decode a message from the radio process."""
    told: FromProcess = _from_process.decode(data)
    return told
