"""The burst scheduler's part while there is no radio: messages may wait, and nothing leaves."""

from math import inf

from sdrlinkd.link.carrier import Opportunity
from sdrlinkd.link.receive import PduHeard
from sdrlinkd.link.transmit.burst import Burst, Outcome
from sdrlinkd.link.transmit.rate import HeardThere
from sdrlinkd.link.transmit.report import TransmitReport
from sdrlinkd.wire import Record


class NoRadio:
    """Answers as a burst scheduler does, truthfully: nothing was sent, nothing will be."""

    bytes_per_s = inf
    airtime_s = 0.0
    record_pdu_s = 0.0
    least_s = 0.0
    has_work = False

    def more_to_send(self) -> None:
        """Nothing is decided, so nothing has to be decided anew."""

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """None: there is nothing to send with."""

    def next_wakeup(self, now: float) -> float:  # noqa: ARG002  # the same at any time
        """Infinity: the radio has to come first."""
        return inf

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """No burst of ours can have left."""

    def pdu_heard(self, event: PduHeard) -> None:
        """Who is heard says nothing of an air that we have no radio for."""

    def record_heard(self, src: int, record: Record, at: float) -> None:
        """What others tell of their schedule is of no use without a radio."""

    def clear(self) -> None:
        """Nothing waits to go again."""

    def access_notices(self, now: float) -> list[str]:  # noqa: ARG002  # the same at any time
        """Empty: no policy is in force."""
        return []

    def heard_by(self, src: int) -> HeardThere:  # noqa: ARG002  # the same for all
        """Nobody hears us."""
        return HeardThere(None, None, 0)

    def report(self) -> TransmitReport:
        """Nothing was sent."""
        return TransmitReport()
