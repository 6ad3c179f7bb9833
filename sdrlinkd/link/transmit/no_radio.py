"""Stands in for the burst scheduler while there is no radio: messages wait, and none leaves."""

from math import inf

from sdrlinkd.link.paths import Edges
from sdrlinkd.link.receive import PduHeard
from sdrlinkd.link.traits import Opportunity
from sdrlinkd.link.transmit.burst import Burst, Outcome
from sdrlinkd.link.transmit.motion import Moves
from sdrlinkd.link.transmit.rate import HeardThere
from sdrlinkd.link.transmit.report import TransmitReport
from sdrlinkd.wire import Pdu, Record


class NoRadio:
    """A burst scheduler without a radio: nothing was sent, and nothing will be."""

    bytes_per_s = inf
    airtime_s = 0.0
    record_pdu_s = 0.0
    least_s = round_s = 0.0
    has_work = False

    def more_to_send(self) -> None:
        """Ignore new messages, as there is no decision to revise."""

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The next burst: None, as there is no radio."""

    def next_wakeup(self, now: float) -> float:  # noqa: ARG002  # the same at any time
        """Earliest time at which there may be something to send: infinity."""
        return inf

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """Ignore an outcome, as no burst of ours can have left."""

    def pdu_heard(self, event: PduHeard) -> None:
        """Ignore a PDU, as there is no access policy to inform."""

    def forwarding(self, pdu: Pdu, at: float) -> None:
        """Ignore a PDU, as there is no access policy to inform."""

    def record_heard(self, src: int, record: Record, at: float) -> None:
        """Ignore a record, as there is no access policy to inform."""

    def clear(self) -> None:
        """Do nothing, as there are no bursts to retry."""

    def know_links(self, edges: Edges) -> None:
        """Ignore links, as there is no access policy to inform."""

    def access_notices(self, now: float) -> list[str]:  # noqa: ARG002  # the same at any time
        """Notices of the access policy: none, as no policy is in force."""
        return []

    def heard_by(self, src: int) -> HeardThere:  # noqa: ARG002  # the same for all
        """How robot `src` hears us: unknown, as we do not send."""
        return HeardThere(None, None, 0)

    def moves(self, src: int, now: float) -> Moves:  # noqa: ARG002  # the same for all
        """How fast the channel to robot `src` changes: unknown, as there is no radio."""
        return Moves()

    def moves_words(self, dst: int, now: float) -> list[str]:  # noqa: ARG002  # the same always
        """Nothing to say, as there is no radio."""
        return []

    def report(self) -> TransmitReport:
        """The report: nothing was sent."""
        return TransmitReport()
