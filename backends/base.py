"""The interface of every radio: blocks of samples in, bursts out."""

from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.complex64]


SENDING = "sending"
"""Gap reason of a half-duplex radio while it sends."""


class BackendError(Exception):
    """A radio or recording cannot be used; the message says what to do about it."""


class AbsentError(BackendError):
    """The radio is absent now, and may appear later."""


class RefusalError(BackendError):
    """The radio is present but rejects its settings."""


class Patience(Enum):
    """What a radio does when its device is absent at opening."""

    NONE = "none"
    """Fail at once, with the reason."""
    THERE = "there"
    """Wait until the device is present."""
    REPLUGGED = "replugged"
    """Wait until the device has been unplugged and is back: it rejected its settings before."""


class TxWindows(NamedTuple):
    """Timing of the TX windows of a radio that must stop receiving to send, in s.

    A burst joins the TX window of the burst before it under two conditions: it is handed over
    `follow_s` before that burst ends, and the window is shorter than `longest_s` at that moment.
    Otherwise it starts `pause_s` after that burst.
    """

    follow_s: float
    pause_s: float
    longest_s: float


@dataclass(frozen=True)
class Capabilities:
    """What a radio can do.

    `paced`: blocks come in real time, otherwise as fast as they are taken. `lockstep`: time
    advances only when every node on the same air has finished the current block, so the next block
    may be requested only when all work on the current one is done. `block_s`: length of a block of
    samples. `lead_s`: how long before its start a burst must be handed over. `turnaround_s`: time
    before and after a burst in which a half-duplex radio hears nothing. `index_error_s`: possible
    error of the indices after a gap, without `timestamps`. `shares_air`: other robots may hear what
    it sends. `tx_windows`: timing of its TX windows, if it needs them.
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
    """Rate and frequency of a radio; the rate holds for both directions, and full scale is ±1."""

    rate_hz: float
    frequency_hz: float


@dataclass(frozen=True, slots=True)
class RxBlock:
    """`n` received samples from absolute index `index` on, or a gap if `samples` is None.

    `host_ns` is the monotonic time of the last sample. `index_uncertainty` is the possible error of
    the index in samples (radios without time stamps, after a gap).
    """

    index: int
    n: int
    samples: Samples | None
    gap_reason: str
    host_ns: int
    index_uncertainty: int = 0


Hear = Callable[[RxBlock], None]


class TxBurst(NamedTuple):
    """Samples to send, the first one at absolute index `start` of the received stream.

    A burst that is too late, or overlaps the one before, starts as soon as possible. If that is
    after `latest`, the burst is not sent. To keep the order, the radio then also drops every later
    burst that has a `latest` and was handed over before the late one was reported. None: no
    deadline.
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
    """Outcome of a burst; `start` and `end`: indices of its first sample and after its last."""

    outcome: TxOutcome
    start: int
    end: int


class Levels(NamedTuple):
    """Recent mean power relative to full scale in dB, and the share of samples that clip."""

    power_dbfs: float
    clipped: float


class Radio(Protocol):
    """Protocol of a radio. Everything but `send` is called from one task."""

    @property
    def capabilities(self) -> Capabilities:
        """What the radio can do; known once it is open."""

    @property
    def counters(self) -> dict[str, int]:
        """Counters of the radio: overflows, late bursts, …; they start at 0 and only grow."""

    @property
    def detail(self) -> str:
        """One line for people: which device, which file."""

    @property
    def trouble(self) -> str:
        """Why the radio delivers nothing now, if it knows; empty: nothing is wrong."""

    @property
    def levels(self) -> Levels | None:
        """Level of the received samples before any filter of ours; None: unknown."""

    async def open(self, tuning: Tuning) -> None:
        """Start to receive at this rate and frequency. Raises BackendError."""

    def blocks(self, hear: Hear | None = None) -> AsyncIterator[RxBlock]:
        """Contiguous blocks from index 0 on, gaps included. Ends with the recording.

        A radio that makes blocks on a thread of its own may pass them to `hear` there, without
        delay. A block that `hear` has received is not yielded.
        """

    def send(self, burst: TxBurst) -> Awaitable[TxReport]:
        """Accept a burst without waiting; the report follows when it has left or cannot leave."""

    async def close(self) -> None:
        """Stop; pending bursts are lost. Closing twice is fine."""


@runtime_checkable
class RelaxingRadio(Protocol):
    """A radio that can make longer blocks while nothing is on the air, to save CPU time.

    It knows of every burst before it begins.
    """

    def relax(self, may_relax: bool) -> None:
        """Allow longer blocks, or no longer allow them; may be called while a block is made."""
