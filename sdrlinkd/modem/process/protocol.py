"""Messages between a daemon and its modem process, on a socket that keeps their boundaries.

The daemon sends Start, then Begin once it wants samples, then one Order for each burst, and Observe
when somebody begins or ends to watch the air, of which Observed then tells. The process
answers Start with Opened or Failed, after Progress while it compiles and Waiting while its radio is
absent. From Begin on it sends Delivered for blocks that complete PDUs, Left for each burst, Status
when something has changed, and Ended when its stream ends. Both sides are of one version: they are
started from one installation.
"""

from enum import Enum
from typing import Any

import msgspec

import phy
from backends import AbsentError, BackendError, Patience, RefusalError
from sdrlinkd.link import Outcome
from sdrlinkd.modem.modem import BurstOrder, ModemStatus
from sdrlinkd.pdulink import AirSeen, Heard, LineSeen

MOST_BYTES = 1 << 18
"""Largest message: 63 PDUs of 2047 B, and some more."""


class Start(msgspec.Struct, frozen=True, array_like=True, tag="start"):
    """The first message to the process: which radio, and how to receive."""

    config: dict[str, Any]
    """The daemon's configuration in plain values."""
    node_id: int
    seed: int
    """Seed of the simulated air."""
    longest_s: float
    """Length of the longest burst in s."""
    patience: Patience
    began_s: float | None
    """Start of the stream's time on the monotonic clock; None: time starts with the samples."""
    listens: bool
    """Whether the receiver senses if the channel is busy."""
    log_level: int


class Begin(msgspec.Struct, frozen=True, array_like=True, tag="begin"):
    """The daemon wants samples from now on."""


class Order(msgspec.Struct, frozen=True, array_like=True, tag="order"):
    """A BurstOrder."""

    number: int
    start: int
    latest: int | None
    late_known: int
    mcs: int
    pdus: list[bytes]
    n_timed: int


class Observe(msgspec.Struct, frozen=True, array_like=True, tag="observe"):
    """Whether the daemon wants to know what is on the air."""

    is_on: bool


class Progress(msgspec.Struct, frozen=True, array_like=True, tag="progress"):
    """The modem is being compiled; `text` says how far it is, and is empty at the end."""

    text: str


class Opened(msgspec.Struct, frozen=True, array_like=True, tag="opened"):
    """The radio is open: its Capabilities in plain values."""

    can: dict[str, Any]


class Blame(Enum):
    """Which error a failure is."""

    ABSENT = "absent"
    REFUSED = "refused"
    OTHER = "other"


_ERRORS = {Blame.ABSENT: AbsentError, Blame.REFUSED: RefusalError, Blame.OTHER: BackendError}


class Failed(msgspec.Struct, frozen=True, array_like=True, tag="failed"):
    """The radio cannot be opened; the process ends."""

    reason: str
    blame: Blame

    @classmethod
    def of(cls, error: BackendError) -> "Failed":
        """The message that tells an error."""
        if isinstance(error, AbsentError):
            return cls(str(error), Blame.ABSENT)
        return cls(str(error), Blame.REFUSED if isinstance(error, RefusalError) else Blame.OTHER)

    def error(self) -> BackendError:
        """The error to raise where the radio was wanted."""
        return _ERRORS[self.blame](self.reason)


class Delivered(msgspec.Struct, frozen=True, array_like=True, tag="delivered"):
    """The PDUs that the samples before index `end` completed."""

    end: int
    heard: list[Heard]
    counters: list[int]
    """The receiver's counters, in the order of `phy.COUNTERS`."""


class Left(msgspec.Struct, frozen=True, array_like=True, tag="left"):
    """A BurstReport."""

    number: int
    outcome: Outcome
    end: int
    start: int | None
    problem: str
    n_samples: int
    modulated_s: float


class Status(msgspec.Struct, frozen=True, array_like=True, tag="status"):
    """A ModemStatus."""

    detail: str
    trouble: str
    power_dbfs: float | None
    clipped: float
    counters: dict[str, int]
    realtime_ratio: float
    scheduling: str
    engine: str
    advice: str
    lines: list[LineSeen]
    others: list[phy.OtherLink]


class Observed(msgspec.Struct, frozen=True, array_like=True, tag="observed"):
    """What is on the air."""

    seen: AirSeen


class Ended(msgspec.Struct, frozen=True, array_like=True, tag="ended"):
    """The stream has ended; `problem` is empty at the end of a recording."""

    problem: str
    is_refusal: bool


def order_of(order: BurstOrder) -> Order:
    """The message that tells a BurstOrder."""
    number, start, latest, late_known, mcs, pdus, n_timed = order
    return Order(number, start, latest, late_known, mcs, list(pdus), n_timed)


def status_of(status: ModemStatus) -> Status:
    """The message that tells a ModemStatus."""
    return Status(
        status.detail,
        status.trouble,
        status.power_dbfs,
        status.clipped,
        dict(status.counters),
        status.realtime_ratio,
        status.scheduling,
        status.engine,
        status.advice,
        list(status.lines),
        list(status.others),
    )


ToModem = Start | Begin | Order | Observe
FromModem = Progress | Opened | Failed | Delivered | Left | Status | Observed | Ended

encode = msgspec.msgpack.Encoder().encode
_to_modem = msgspec.msgpack.Decoder(ToModem)
_from_modem = msgspec.msgpack.Decoder(FromModem)


def to_modem(data: bytes | memoryview) -> ToModem:
    """Decode a message from the daemon. Raises msgspec.DecodeError."""
    told: ToModem = _to_modem.decode(data)
    return told


def from_modem(data: bytes | memoryview) -> FromModem:
    """Decode a message from the modem process. Raises msgspec.DecodeError."""
    told: FromModem = _from_modem.decode(data)
    return told
