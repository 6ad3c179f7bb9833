"""Estimates the offset of two clocks from the shortest delays of each direction.

No delay is negative, so a burst from the other robot bounds the offset from above, and its report
about our burst bounds it from below. The shortest delays of the two directions need not belong
together, so with N messages each way the error falls as 1/N; a filter over round trips gains only
1/√N. Delays are counted beyond the airtime, which both robots know.

Clocks drift, and crystals move. The offset is that of the most likely line through the samples of
the last minute (`fit`). The bound covers every possible line, however unlikely, of a frequency that
moves (`wander`). It also covers three kinds of contradiction:

- The two directions fit no line, not even a bent one. Either the latest samples contradict each
  other nearly as much, then stamps are noisy, and the bound grows by the contradiction. Or they do
  not, then the clock's rate has changed, and the older half of the samples is dropped.
- Few samples contradict the others by at most STEP_S. They are held back (`way`), and the bound
  grows by twice that, as the clock may just have begun to move.
- Many do. The clock has moved: all older samples are dropped. As long as the move may turn out
  false (`before`), the bound covers both.
"""

import numpy as np

from sdrlinkd.link.timesync.before import Before
from sdrlinkd.link.timesync.estimate import Estimate
from sdrlinkd.link.timesync.fit import Fit, Lines
from sdrlinkd.link.timesync.wander import Wander
from sdrlinkd.link.timesync.way import STEP_S, WINDOW_S, Held, Way

NOISE_S, NOISE_SHARE = 15.0, 0.5
"""Stamps are noisy if the contradiction among those of the last NOISE_S is at least NOISE_SHARE of
that among all. In so short a time, wander bends a line by a sixteenth of what it does in 60 s."""


class DualEnvelope:
    """Estimates the offset of two robots' clocks; all times are in s.

    `resolution_s` is the resolution of the time stamps. A sample that contradicts the others is
    held back until it is clear which of them are wrong.
    """

    def __init__(self, resolution_s: float = 2e-5) -> None:
        self._resolution_s = resolution_s
        self._above, self._below = self._ways = Way(1.0), Way(-1.0)
        self._wander = Wander(self._resolution_s, WINDOW_S)
        self._before: Before | None = None
        self._known: Estimate | None = None
        """The estimate without doubts."""
        self.estimate: Estimate | None = None
        self.samples = 0
        self.steps = 0
        """How often a clock was seen to jump."""
        self.false_steps = 0
        """How often a clock was taken to have jumped, but had not; not among `steps`."""
        self.contradicted = 0
        """Time stamps rejected because they contradict the others."""
        self.narrowed = 0
        """How often older samples were dropped because no line and no crystal explains them."""

    def heard(self, sent_there: float, came_here: float, airtime_s: float) -> None:
        """Take a burst of the other robot: sent at its time, heard at ours."""
        self._note(self._above, self._below, came_here, came_here - sent_there - airtime_s)

    def was_heard(self, sent_here: float, came_there: float, airtime_s: float) -> None:
        """Take a burst of ours: sent at our time, heard at the other robot's."""
        self._note(self._below, self._above, sent_here, came_there - sent_here - airtime_s)

    def solve(self, now: float) -> Estimate | None:
        """The estimate at `now` from all samples; None while a direction has none."""
        for way in self._ways:
            way.side.forget_before(now - WINDOW_S)
        self._known = self.estimate = None
        while self._above.side and self._below.side:
            fit = self._fit(now)
            if fit is not None:
                self._known = self._bounded(fit, now)
                self.estimate = self._doubted(self._known)
                break
            self.narrowed += 1
            self._drop_older_half()
        return self.estimate

    def forget(self) -> None:
        """Forget all samples, as the other robot has a new clock."""
        for way in self._ways:
            way.clear()
        self._wander = Wander(self._resolution_s, WINDOW_S)
        self._before = self._known = self.estimate = None

    def _fit(self, now: float) -> Fit | None:
        """The most likely line, with the least wander that explains all samples; None: none does.

        Each stamp may be off by its resolution, or by more if stamps are noisy.
        """
        above, below = self._above.side, self._below.side
        learned = self._wander.learned(now)
        fit = Fit(above, below, now, self._resolution_s, learned)
        if fit.gap_s >= -2 * self._resolution_s or self._is_noisy(now, fit.gap_s):
            return fit
        for wander in self._wander.steps(now):
            fit = Fit(above, below, now, self._resolution_s, wander)
            if fit.gap_s >= -2 * self._resolution_s:
                self._wander.learn(wander, now)
                return fit
        return None

    def _is_noisy(self, now: float, gap_s: float) -> bool:
        """Whether the latest samples fit a line hardly better than all, and all nearly do."""
        latest = Lines(self._above.side, self._below.side, now, 0.0, NOISE_S)
        return gap_s >= -STEP_S and latest.is_known and latest.widest()[1] < NOISE_SHARE * gap_s

    def _bounded(self, fit: Fit, now: float) -> Estimate:
        """The likely line with the bounds of all possible ones, in which the wander is larger."""
        wander = self._wander.allowed(now)
        lines = Lines(self._above.side, self._below.side, now, wander)
        slack_s = self._resolution_s + max(0.0, -float(lines.gaps(np.array([fit.best]))[0]))
        lowest, highest = lines.possible(fit.best, fit.step, -2 * slack_s)
        # All samples are in the past, so the offset at `now` grows with the slope for both bounds.
        above, below = lines.bounds(np.array([lowest, highest]))
        least_s, most_s = -float(below[0]) - slack_s, float(above[1]) + slack_s
        offset_s, skew = fit.line()
        return Estimate(
            now,
            offset_s,
            skew,
            max(most_s - offset_s, offset_s - least_s),
            max(highest - skew, skew - lowest),
            wander,
        )

    def _doubted(self, known: Estimate) -> Estimate:
        """The estimate with a bound that holds even if the samples held back are right.

        It also holds if the last move of the clock turns out false.
        """
        bound_s = known.bound_s + max(way.doubt_s for way in self._ways)
        skew_bound = known.skew_bound
        if self._before is not None:
            before = self._before.known
            moved_s = abs(known.offset_s - before.offset(known.at))
            bound_s = max(bound_s, moved_s + before.bound(known.at))
            skew_bound = max(skew_bound, abs(known.skew - before.skew) + before.skew_bound)
        return known._replace(bound_s=bound_s, skew_bound=skew_bound)

    def _note(self, way: Way, other: Way, x: float, v: float) -> None:
        self.samples += 1
        if self._before is not None:
            self._before.note(way.sign, x, v)
            if self._before.is_false:
                self._undo(self._before)
                return
            if self._before.is_settled:
                self._before = None
        known = self._known
        if known is None:
            way.take(x, v, 0.0)
            return
        early_s = known.early_s(x, v, way.sign)
        if early_s > 0:
            self.contradicted += 1
            way.hold(Held(x, v, early_s))
            if way.has_moved(other.side):
                self._restart(way, other, known)
        else:
            way.take(x, v, way.sign * known.skew)
            other.refute(x, known.delay_s(x, v, way.sign))
            if other.has_moved(way.side):
                self._restart(other, way, known)

    def _restart(self, way: Way, other: Way, known: Estimate) -> None:
        """Start over with the contradicting samples, and those of the other direction since."""
        held = way.held
        is_step = max(each.early_s for each in held) > STEP_S
        self._before = Before(self._ways, way, known, is_step=is_step)
        way.clear()
        other.clear_held()
        other.side.forget_before(held[0].x)
        for x, v, _ in held:
            way.side.add(x, v, way.sign * known.skew)
        self.contradicted -= len(held)
        self.steps += is_step
        self.narrowed += not is_step
        self._known = self.estimate = None

    def _undo(self, before: Before) -> None:
        """Go back to what was known before a step that turned out false."""
        self._before, self._known, self.estimate = None, before.known, before.known
        self.steps -= before.is_step
        self.false_steps += before.is_step
        self.contradicted += len(before.held)
        for way, side in zip(self._ways, before.sides, strict=True):
            way.clear()
            way.side = side
        for sign, x, v in before.since:
            way = self._above if sign > 0 else self._below
            if before.known.early_s(x, v, sign) > 0:
                self.contradicted += 1
            else:
                way.take(x, v, sign * before.known.skew)

    def _drop_older_half(self) -> None:
        times = np.concatenate((self._above.side.x, self._below.side.x))
        middle = np.nextafter(float(np.median(times)), np.inf)
        for way in self._ways:
            way.side.forget_before(middle)
