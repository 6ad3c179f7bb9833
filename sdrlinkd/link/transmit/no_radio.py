"""The burst scheduler's part while there is no radio: messages may wait, and nothing leaves."""

from math import inf

from sdrlinkd.link.receive import PduHeard
from sdrlinkd.link.traits import Opportunity
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
        """Ignore what has come: nothing is decided, so nothing has to be decided anew."""

    def next_burst(self, opportunity: Opportunity) -> Burst | None:
        """The next burst: none, as there is nothing to send with."""

    def next_wakeup(self, now: float) -> float:  # noqa: ARG002  # the same at any time
        """When there may next be something to send: never, the radio has to come first."""
        return inf

    def confirm(self, burst: Burst, outcome: Outcome, now: float) -> None:
        """Ignore a burst: none of ours can have left."""

    def pdu_heard(self, event: PduHeard) -> None:
        """Ignore who is heard: there is no policy to tell."""

    def record_heard(self, src: int, record: Record, at: float) -> None:
        """Ignore what others tell: there is no policy to tell it to."""

    def clear(self) -> None:
        """Forget bursts that go again: there are none."""

    def access_notices(self, now: float) -> list[str]:  # noqa: ARG002  # the same at any time
        """Notices of the access policy: none, as none is in force."""
        return []

    def heard_by(self, src: int) -> HeardThere:  # noqa: ARG002  # the same for all
        """How robot `src` hears us: it does not."""
        return HeardThere(None, None, 0)

    def report(self) -> TransmitReport:
        """What was sent: nothing."""
        return TransmitReport()
