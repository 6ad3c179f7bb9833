"""Messages of the control socket between daemon and radio process."""

from enum import Enum

import msgspec

from backends.base import AbsentError, BackendError, Patience, RefusalError
from backends.soapy.settings import DeviceInfo, SoapySettings

MOST_BYTES = 1 << 16


class Open(msgspec.Struct, frozen=True, tag="open"):
    """The first message to the process: which device, set how."""

    settings: SoapySettings
    rx_samples: int
    """Samples that the shared memory for receiving holds."""
    tx_samples: int
    """Samples that the shared memory for sending holds."""
    patience: Patience = Patience.NONE


class Begin(msgspec.Struct, frozen=True, tag="begin"):
    """The daemon wants samples from now on."""


class TxCommand(msgspec.Struct, frozen=True, tag="tx"):
    """Send `n` samples that lie at `at`, from index `start` on, or at the latest from `latest`."""

    number: int
    start: int
    n: int
    at: int
    latest: int | None


class Opened(msgspec.Struct, frozen=True, tag="opened"):
    """The device is open and takes its settings."""

    found: DeviceInfo


class Blame(Enum):
    """Why a device does not stream."""

    ABSENT = "absent"
    """It is not there, in use, or went away."""
    SETTINGS = "settings"
    """It is there and does not take its settings."""
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
        """The error to raise to whoever wanted the device open."""
        return _ERRORS[self.blame](self.reason)


class TxDone(msgspec.Struct, frozen=True, tag="tx_done"):
    """What became of a TxCommand: `outcome` by name of TxOutcome."""

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
    """Decode what the daemon says once the device is open."""
    told: Begin | TxCommand = _to_process.decode(data)
    return told


def from_process(data: bytes) -> FromProcess:
    """Decode what the radio process says."""
    told: FromProcess = _from_process.decode(data)
    return told
