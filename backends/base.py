"""What every radio is to those above it: blocks of samples in, bursts out."""

from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.complex64]


SENDING = "sending"
"""Why a half-duplex radio's gap is one."""


class BackendError(Exception):
    """A radio or recording that cannot be used; the message says what to do about it."""


class AbsentError(BackendError):
    """A radio that is not there now, and may come."""


class RefusalError(BackendError):
    """A radio that is there and does not take its settings."""


class Patience(Enum):
    """What a radio does when it is opened and is not there."""

    NONE = "none"
    """It fails at once, and says why."""
    THERE = "there"
    """It waits until it is there."""
    REPLUGGED = "replugged"
    """It waits until it has been away and is back: it refused its settings before."""


class TxWindows(NamedTuple):
    """How a radio sends that must stop receiving for it, in s.

    A burst follows the one before in the same TX window when it is handed over `follow_s` before
    that one ends, and the window is shorter than `longest_s` then; else it begins `pause_s` after
    it.
    """

    follow_s: float
    pause_s: float
    longest_s: float


@dataclass(frozen=True)
class Capabilities:
    """What a radio can do.

    `paced`: blocks come in real time; else as fast as they are taken. `lockstep`: time waits for
    everybody on the same air, so one block is asked for only when all that follows from the one
    before has been done. `block_s`: samples come in pieces of this length. `lead_s`: how long
    before its start a burst must be handed over. `turnaround_s`: for so long before and after a
    burst a half-duplex radio hears nothing. `index_error_s`: how wrong indices may be after a gap,
    where there are no `timestamps`. `shares_air`: other robots may hear what it sends.
    `tx_windows`: it sends in those.
    """

    receives: bool
    transmits: bool
    full_duplex: bool
    timestamps: bool
    paced: bool
    lead_s: float = 0.0
    turnaround_s: float = 0.0
    lockstep: bool = False
    index_error_s: float = 0.0
    block_s: float = 0.001
    shares_air: bool = True
    tx_windows: TxWindows | None = None


@dataclass(frozen=True)
class Tuning:
    """What a radio is set to; one rate for both directions, samples at ±1 full scale."""

    rate_hz: float
    frequency_hz: float


@dataclass(frozen=True, slots=True)
class RxBlock:
    """`n` received samples from absolute index `index` on, or, when `samples` is None, a gap.

    `host_ns` is the monotonic time at which the last of them was there. `index_uncertainty`: by how
    many samples the index may be wrong (radios without time stamps, after a gap).
    """

    index: int
    n: int
    samples: Samples | None
    gap_reason: str
    host_ns: int
    index_uncertainty: int = 0


Hear = Callable[[RxBlock], None]


class TxBurst(NamedTuple):
    """Samples whose first leaves at absolute index `start` of the received stream.

    A burst that comes too late, or overlaps the one before, begins as soon as it can. When that is
    after `latest` it does not leave at all, nor do others that have a `latest` and were handed over
    behind it before its report was there: nothing overtakes. None: whenever.
    """

    start: int
    samples: Samples
    latest: int | None = None


class TxOutcome(Enum):
    """What became of a burst that was handed over."""

    SENT = "sent"
    LATE = "late"
    UNDERFLOW = "underflow"
    LOST = "lost"


class TxReport(NamedTuple):
    """`start` and `end`: index of the first sample that left, and after the last."""

    outcome: TxOutcome
    start: int
    end: int


class Levels(NamedTuple):
    """Mean power in dB below full scale, and the share of samples that clip; both lately."""

    power_dbfs: float
    clipped: float


class Radio(Protocol):
    """One radio. Everything but `send` is called from one task."""

    @property
    def capabilities(self) -> Capabilities:
        """What it can do; known once it is open."""

    @property
    def counters(self) -> dict[str, int]:
        """What it counts: overflows, late bursts, …; all growing from 0."""

    @property
    def detail(self) -> str:
        """One line for people: which device, which file."""

    @property
    def trouble(self) -> str:
        """Why nothing comes from it now, where it knows; empty: nothing is wrong."""

    @property
    def levels(self) -> Levels | None:
        """How strong what it hears is, before any filter of ours; None: that is not known."""

    async def open(self, tuning: Tuning) -> None:
        """Begin to receive at this rate and frequency. Raises BackendError."""

    def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """Contiguous blocks from index 0 on; gaps are blocks too. Ends with the recording.

        A radio that makes them on a thread of its own may give them to `hear` there, at once; what
        `hear` has had is not yielded.
        """

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Take a burst at once; the report comes when its last sample has left, or it cannot."""

    async def close(self) -> None:
        """Stop; bursts on their way are lost. Closing twice is fine."""
