"""The seam between the link and whatever carries its PDUs."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from sdrlinkd.link import Burst, Outcome
from sdrlinkd.reports import CarrierReport


class Heard(NamedTuple):
    """A PDU from the air: its bytes, when its burst's preamble arrived, and how good it was."""

    data: bytes
    at: float
    snr_db: float | None = None


class Opportunity(NamedTuple):
    """The carrier can take a burst of at most `max_pdus` whose preamble would leave at `start`."""

    start: float
    max_pdus: int


class PduListener(Protocol):
    """Whom a PDU link tells. Called on the event loop; must not wait."""

    def heard(self, pdus: Sequence[Heard]) -> None:
        """PDUs arrived."""

    def settled(self, burst: Burst, outcome: Outcome, at: float) -> None:
        """A burst's last bit left, or did not."""


class PduLink(Protocol):
    """Carries PDUs: the direct link, a modem with a radio, a GNU Radio flowgraph.

    The next burst is composed only when `opportunity` has returned, never before.
    """

    def now(self) -> float:
        """Seconds on the link's clock."""

    async def open(self, listener: PduListener) -> None:
        """Begin to listen. Raises UserError when the carrier cannot be had."""

    async def run(self) -> None:
        """Carry PDUs until cancelled, in the daemon's task group."""

    async def opportunity(self) -> Opportunity:
        """Wait until the carrier can take the next burst."""

    def send(self, burst: Burst) -> None:
        """Take a burst at the opportunity just given; `settled` tells what became of it."""

    async def idle(self) -> None:
        """Wait until every burst taken is settled."""

    async def close(self) -> None:
        """Stop; closing twice is fine. What has not left is settled as lost."""

    def report(self) -> CarrierReport:
        """State and counters."""
