"""The interface between the link and its PDU link."""

from collections.abc import Callable, Coroutine, Sequence
from typing import NamedTuple, Protocol

from sdrlinkd.link import Burst, Opportunity, Outcome, PduLinkTraits
from sdrlinkd.reports import PduLinkReport


class Heard(NamedTuple):
    """A PDU from the air: its bytes, the time of its burst's preamble, and its SNR.

    `ended_at` is when its last sample arrived; None: at the same time. `doppler_hz` is that of the
    burst's echoes; None: not known, or not yet.
    """

    data: bytes
    at: float
    snr_db: float | None = None
    ended_at: float | None = None
    doppler_hz: float | None = None


class BurstSeen(NamedTuple):
    """A burst on the air whose header was read; times in s on the link's clock.

    `ending`: whole, faded (its power vanished), cut (samples are missing), or foreign (of another
    network).
    """

    at: float
    length_s: float
    mcs: int
    n_pdus: int
    n_good: int
    snr_db: float
    rssi_dbfs: float
    ending: str


class LineSeen(NamedTuple):
    """A tone or narrow signal that the modem cuts out of what it receives."""

    offset_hz: float
    """Its frequency in Hz, relative to the centre of the channel."""
    power_dbfs: float
    over_noise_db: float | None
    """Its power over that of the noise in dB; None: the modem does not listen for energy."""
    width: float
    """Share of the band that is cut for it."""
    moves: bool
    """Whether it sweeps through the band."""


class AirSeen(NamedTuple):
    """What a modem has seen of the air since it last said so, for people.

    `mean` and `peak` are levels of equal parts of the band, as int8 in dB relative to full scale,
    the lowest frequency first. `points` are pairs of int8: the last equalised points, in 1/32 of
    the mean amplitude.
    """

    until: float
    """End of what was seen, in s on the link's clock."""
    rate_hz: float
    bursts: list[BurstSeen]
    mean: bytes
    peak: bytes
    points: bytes
    modulation: str
    n_unreadable: int
    """Preambles without a readable header, of bursts that were too weak or collided."""
    lines: list[LineSeen]


Observe = Callable[[AirSeen], None]


class PduListener(Protocol):
    """The user of a PDU link. Its methods are called on the event loop and must not wait."""

    def attach(self, traits: PduLinkTraits) -> None:
        """Fit to the PDU link, which has just opened. Raises ConfigError if it is not suitable."""

    def heard(self, pdus: Sequence[Heard]) -> None:
        """Take PDUs that have arrived."""

    def advance(self, now: float) -> None:
        """Advance to time `now`; called only in lock-step."""

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The burst to send now; None: nothing to send, or not yet."""

    def next_wakeup(self, now: float) -> float:
        """Earliest time at which there may be something to send; if not after `now`: at once."""

    def settled(self, burst: Burst, outcome: Outcome, at: float) -> None:
        """Take the outcome of a burst, which has left completely or not."""


Carry = Callable[[], Coroutine[object, object, None]]
"""Carries PDUs until cancelled.

Raises LinkAbsentError when what carries them is gone, and LinkRefusedError when a radio refuses its
settings.
"""


class PduLink(Protocol):
    """A PDU link carries PDUs: the direct link, a modem with a radio, a GNU Radio flowgraph.

    It requests a burst only when it can take one, never earlier.
    """

    def now(self) -> float:
        """Time in s on the link's clock."""

    async def open(self, listener: PduListener) -> Carry:
        """Open the link, pass its traits to the listener, and return what carries PDUs.

        Raises LinkAbsentError or LinkRefusedError if another try may succeed, and UserError if a
        person has to fix something first. After an error, the link can only be closed.
        """

    def wake(self) -> None:
        """Check again whether there is something to send."""

    def observe(self, tell: Observe | None) -> None:
        """Call `tell` with what is on the air, some times a second; None: no longer.

        A link without a modem has nothing to tell.
        """

    async def idle(self) -> None:
        """Wait until every burst handed over is settled."""

    async def close(self) -> None:
        """Close the link, also repeatedly; bursts that have not left are settled as lost."""

    def report(self) -> PduLinkReport:
        """The state of the PDU link, and its counters."""
