"""The Sensors paper's filter as a link's clock estimate: `clock.filter = "paper"`.

The paper smooths one offset per round trip. Here two CLOCK records make a round trip: ours, which
the other robot heard, and its own, which we heard. Their four times are those of a four-stamp
exchange. The paper gives no bound. Half a round trip is a bound, as no delay is negative, so we use
the largest of the last round trips. Until the filter has converged, after 500 round trips, there is
no estimate.
"""

from collections import deque

from sdrlinkd.link.timesync.estimate import Estimate
from sdrlinkd.link.timesync.fit import MOST
from sdrlinkd.link.timesync.paper import PaperFilter

LATELY = 64
"""Number of recent round trips of which the longest gives the bound."""


class PaperClock:
    """Estimates the offset of two robots' clocks by the paper's filter; times are in s.

    It has the same interface as `DualEnvelope`.
    """

    def __init__(self) -> None:
        self._filter = PaperFilter()
        self._steps = 0
        self._came: tuple[float, float] | None = None
        self._went: tuple[float, float] | None = None
        self._trips_s: deque[float] = deque(maxlen=LATELY)
        self.estimate: Estimate | None = None
        self.samples = 0
        """Round trips taken."""
        self.false_steps = 0
        """Always 0: a reset is never undone."""
        self.contradicted = 0
        """Round trips that were too long, or whose offset was too far from the known one."""

    @property
    def steps(self) -> int:
        """How often the filter reset itself, over all boots of the other robot."""
        return self._steps + self._filter.resets

    def heard(self, sent_there: float, came_here: float, airtime_s: float) -> None:
        """Take a burst of the other robot: sent at its time, heard at ours."""
        self._came = (sent_there, came_here - airtime_s)
        self._take()

    def was_heard(self, sent_here: float, came_there: float, airtime_s: float) -> None:
        """Take a burst of ours: sent at our time, heard at the other robot's."""
        self._went = (sent_here, came_there - airtime_s)
        self._take()

    def solve(self, now: float) -> Estimate | None:
        """The estimate at `now`; None until the filter has converged.

        As in the paper, nothing is extrapolated; the bound grows with the largest difference of two
        crystals.
        """
        self.estimate = None
        if self._filter.converged:
            offset_s = 1e-6 * self._filter.offset_estimated
            self.estimate = Estimate(now, offset_s, 0.0, max(self._trips_s) / 2, MOST)
        return self.estimate

    def forget(self) -> None:
        """Forget all samples, as the other robot has a new clock."""
        self._steps = self.steps
        self._filter = PaperFilter()
        self._came = self._went = self.estimate = None
        self._trips_s.clear()

    def _take(self) -> None:
        if self._came is None or self._went is None:
            return
        (t3, t4), (t1, t2) = self._came, self._went
        self._came = self._went = None
        before = self._filter.n
        self._filter.update_four(*(1e6 * t for t in (t1, t2, t3, t4)))
        if self._filter.n > before:
            self.samples += 1
            self._trips_s.append(max(0.0, (t4 - t1) - (t3 - t2)))
        else:
            self.contradicted += 1
