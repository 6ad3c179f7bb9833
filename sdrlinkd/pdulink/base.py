"""The seam between the link and what carries its PDUs."""

from collections.abc import Callable, Coroutine, Sequence
from typing import NamedTuple, Protocol

from sdrlinkd.link import Burst, Opportunity, Outcome, PduLinkTraits
from sdrlinkd.reports import PduLinkReport


class Heard(NamedTuple):
    """A PDU from the air: its bytes, when its burst's preamble arrived, and how good it was.

    `ended_at` is when its last sample arrived; None: that takes no time.
    """

    data: bytes
    at: float
    snr_db: float | None = None
    ended_at: float | None = None


class PduListener(Protocol):
    """Whom a PDU link tells and asks. It is called on the event loop and must not wait."""

    def attach(self, traits: PduLinkTraits) -> None:
        """Fit to the PDU link, which is there now. Raises ConfigError when that does not do."""

    def heard(self, pdus: Sequence[Heard]) -> None:
        """Take PDUs that have arrived."""

    def advance(self, now: float) -> None:
        """Let time come so far; called where time is that of the samples and nobody's clock."""

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The burst that the PDU link shall send now; None: nothing, or not yet."""

    def next_wakeup(self, now: float) -> float:
        """When there may next be something to send; up to `now`: there is already."""

    def settled(self, burst: Burst, outcome: Outcome, at: float) -> None:
        """Take what became of a burst: its last bit left, or did not."""


Carry = Callable[[], Coroutine[object, object, None]]
"""Carries PDUs until cancelled. Raises LinkRefusedError when a radio refuses its settings."""


class PduLink(Protocol):
    """Carries PDUs: the direct link, a modem with a radio, a GNU Radio flowgraph.

    It asks for a burst only at the moment that it can take one, never before.
    """

    def now(self) -> float:
        """Seconds on the link's clock."""

    async def open(self, listener: PduListener) -> Carry:
        """Begin to listen, and tell the listener what there is; what carries PDUs from now on.

        Raises LinkAbsentError or LinkRefusedError where another try may succeed, and UserError
        where a person has to mend something first. Then it can only be closed.
        """

    def wake(self) -> None:
        """Look again for something to send."""

    async def idle(self) -> None:
        """Wait until every burst taken is settled."""

    async def close(self) -> None:
        """Stop; closing twice is fine. What has not left is settled as lost."""

    def report(self) -> PduLinkReport:
        """The state of the PDU link, and its counters."""
