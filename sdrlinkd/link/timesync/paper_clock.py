"""The Sensors paper's filter as a link's clock estimate: `clock.filter = "paper"`.

The paper smooths one offset for each round trip. Two CLOCK records make one here: ours, which the
other robot heard, and its own, which we heard. Their four times are those of a four-stamp exchange.
The paper tells no bound. Half a round trip is one, for no delay is negative, so the largest of the
last round trips gives it. Until the filter has converged, after 500 round trips, nothing is known.
"""

from collections import deque

from sdrlinkd.link.timesync.envelope import MOST, Estimate
from sdrlinkd.link.timesync.paper import PaperFilter

LATELY = 64
"""Round trips of which the longest gives the bound."""


class PaperClock:
    """The clocks of two robots by the paper's filter; the face of `DualEnvelope`, times in s."""

    def __init__(self) -> None:
        self._filter = PaperFilter()
        self._steps = 0
        self._came: tuple[float, float] | None = None
        self._went: tuple[float, float] | None = None
        self._trips_s: deque[float] = deque(maxlen=LATELY)
        self.estimate: Estimate | None = None
        self.samples = 0
        """Round trips that were taken."""
        self.contradicted = 0
        """Round trips that were too long, or an offset too far from the one known."""

    @property
    def steps(self) -> int:
        """Times that the filter began anew by itself, over all boots of the other robot."""
        return self._steps + self._filter.resets

    def heard(self, sent_there: float, came_here: float, airtime_s: float) -> None:
        """Take a burst of the other robot: its own time of sending, ours of hearing."""
        self._came = (sent_there, came_here - airtime_s)
        self._take()

    def was_heard(self, sent_here: float, came_there: float, airtime_s: float) -> None:
        """Take a burst of ours: our own time of sending, its of hearing."""
        self._went = (sent_here, came_there - airtime_s)
        self._take()

    def solve(self, now: float) -> Estimate | None:
        """The estimate at `now`; None until the filter has converged.

        As the paper has it, nothing is extrapolated: the bound grows by what two crystals may
        differ.
        """
        self.estimate = None
        if self._filter.converged:
            offset_s = 1e-6 * self._filter.offset_estimated
            self.estimate = Estimate(now, offset_s, 0.0, max(self._trips_s) / 2, MOST)
        return self.estimate

    def forget(self) -> None:
        """Forget all samples: the other clock is another one now."""
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
