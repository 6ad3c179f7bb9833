"""What the modem link asks of a modem, wherever it runs: bursts of PDUs out, PDUs in."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

import phy
from backends import Capabilities
from sdrlinkd.link import Outcome, Sensed
from sdrlinkd.modem.clock import Seen
from sdrlinkd.pdulink import Heard, LineSeen, Observe

COUNTERS = (
    "overflows",
    "samples_lost",
    "late",
    "bursts_slipped",
    "bursts_postponed",
    "samples_sent",
    *phy.COUNTERS,
)
"""Counters that every modem has."""


class BurstOrder(NamedTuple):
    """PDUs to send as one burst, the first sample at index `start` of the received stream.

    A modem that would miss that start by far starts it later. A burst that cannot start by `latest`
    is reported late and not sent. Neither is a burst if one before it was late and is not among the
    `late_known` late ones that the order's author knew: the order of messages would be lost.
    """

    number: int
    start: int
    latest: int | None
    late_known: int
    mcs: int
    pdus: Sequence[bytes]
    n_timed: int = 0
    """How many PDUs, the first ones, must be adjusted if the burst starts later; see
    `wire.postponed`."""


class BurstReport(NamedTuple):
    """The outcome of burst `number`, the index of its end and, in words, what went wrong."""

    number: int
    outcome: Outcome
    end: int
    start: int | None = None
    """Index of the burst's first sample, if it left."""
    problem: str = ""
    n_samples: int = 0
    modulated_s: float = 0.0
    """Samples that were modulated, and the time in s that this took."""


class ModemStatus(NamedTuple):
    """What a modem tells of itself and its radio."""

    detail: str
    """The radio in one line for people."""
    trouble: str
    """Why the radio delivers nothing now, if it knows."""
    power_dbfs: float | None
    clipped: float
    """Recent mean power of the received samples, and the share that clips."""
    counters: Mapping[str, int]
    realtime_ratio: float
    """Demodulation speed relative to real time; 0: not known yet."""
    scheduling: str = ""
    """How the kernel runs the modem's process, in words; empty: not asked for anything."""
    engine: str = ""
    """What computes the modem, in words; empty: not known yet."""
    advice: str = ""
    """What to do about what the kernel refused, in a sentence; empty: nothing."""
    lines: Sequence[LineSeen] = ()
    """What is cut out of the received samples now, the strongest first."""
    others: Sequence[phy.OtherLink] = ()
    """Other links that were heard in the last 10 s, the most often first."""


class ModemUser(Protocol):
    """Who runs a modem. All methods are called on the event loop."""

    def delivered(self, heard: Sequence[Heard], end: int) -> None:
        """Take the PDUs that the samples before index `end` completed; there may be none."""

    def left(self, report: BurstReport) -> None:
        """Take the outcome of a burst."""

    def ended(self, problem: str, is_refusal: bool) -> None:
        """Note that the stream has ended; `problem` is empty at the end of a recording."""


class Modem(Protocol):
    """Turns PDUs into bursts on a radio, and the radio's samples into PDUs."""

    wakes: bool
    """Whether `delivered` is called for every block, even without PDUs."""

    @property
    def seen(self) -> Seen | None:
        """The last block, as the clock needs it; None: no block yet."""

    @property
    def sensed(self) -> Sensed:
        """The state of the channel after the last block."""

    @property
    def trouble(self) -> str:
        """Why the radio delivers nothing now, if it knows."""

    @property
    def status(self) -> ModemStatus:
        """Radio, counters and load."""

    async def open(self) -> Capabilities:
        """Open the radio and return what it can do. Raises BackendError."""

    async def run(self, user: ModemUser) -> None:
        """Receive and send until cancelled. Raises AbsentError if the modem's process ends."""

    def send(self, order: BurstOrder) -> None:
        """Send a burst; `left` follows."""

    def observe(self, tell: Observe | None) -> None:
        """Call `tell` with what is on the air, some times a second; None: no longer."""

    async def close(self) -> None:
        """Close the radio; bursts that have not left are not reported. Closing twice is fine."""


class NoModem:
    """Stands in for a modem until there is one."""

    wakes = False
    seen: Seen | None = None
    sensed = Sensed(until=0.0)
    trouble = ""
    status = ModemStatus("not open", "", None, 0.0, dict.fromkeys(COUNTERS, 0), 0.0)

    async def open(self) -> Capabilities:
        """Raise RuntimeError: there is no modem yet."""
        raise RuntimeError("no modem yet")

    async def run(self, user: ModemUser) -> None:
        """Raise RuntimeError: there is no modem yet."""
        raise RuntimeError(f"no modem yet for {user}")

    def send(self, order: BurstOrder) -> None:
        """Raise RuntimeError: there is no modem yet."""
        raise RuntimeError(f"no modem yet for burst {order.number}")

    def observe(self, tell: Observe | None) -> None:
        """There is nothing to see."""

    async def close(self) -> None:
        """There is nothing to close."""
