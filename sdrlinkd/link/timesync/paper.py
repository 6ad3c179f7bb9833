"""The filter of the Sensors 2023 paper, as printed: Equations 1 to 9, Algorithm 3.

Where the sources differ:

- Equation 5 has no absolute value, but Algorithm 3 (line 12) and PX4's source do; we follow them.
- In the text, Equation 5 applies from the first sample on. An estimate that starts at 0 then never
  approaches a clock that is more than 100 ms away. In Algorithm 3 (line 14), in PX4 and here, the
  deviation is checked only after convergence.
- PX4's comment says that five deviant samples cause a reset; its source, like line 17, requires
  six. Samples with too long a round trip in between do not count.
- Round trips that are too long are counted, but the count has no effect; PX4 logs it.
- Equation 1 uses one remote stamp. The remote robot's response time is then part of the round trip,
  and half of it is part of the offset. With a fourth stamp, as in MAVLink's and XRCE-DDS's own
  messages, `update_four` excludes that time; PX4 does not.
- Skew is per sample, not per second, and nothing is extrapolated between samples.
- Before convergence, PX4 takes a remote stamp to mean now; here `synced` is None.
"""

import math

CONVERGENCE_WINDOW = 500
ALPHA_MAX = BETA_MAX = 0.05
ALPHA_MIN = BETA_MIN = 0.003
MAX_RTT_US = 10_000
MAX_DEVIATION_US = 100_000
MAX_CONSECUTIVE_HIGH_DEVIATION = 5


class PaperFilter:
    """Offset and skew of a remote clock by double exponential smoothing; times in µs, as in PX4.

    `offset_estimated` is local minus remote time.
    """

    def __init__(self) -> None:
        self.resets = -1
        self.reset_filter()

    @property
    def converged(self) -> bool:
        """Whether enough samples have come (Equation 6)."""
        return self.n >= CONVERGENCE_WINDOW

    def update(self, t_packet_creation: float, t_remote_stamp: float, t_current: float) -> None:
        """Algorithm 3, UPDATE: when our packet was made, the answer's stamp, when that came."""
        if t_remote_stamp <= 0:
            return
        offset_observed = (t_packet_creation + t_current - 2 * t_remote_stamp) / 2
        self._take(offset_observed, t_current - t_packet_creation)

    def update_four(self, t1: float, t2: float, t3: float, t4: float) -> None:
        """UPDATE with four stamps: the remote robot reports when it received (t2) and sent (t3)."""
        self._take(((t1 + t4) - (t2 + t3)) / 2, (t4 - t1) - (t3 - t2))

    def synced(self, t_remote: float) -> float | None:
        """A remote time in local time; None until the filter has converged."""
        return t_remote + self.offset_estimated if self.converged else None

    def reset_filter(self) -> None:
        """Reset the filter (Algorithm 3, RESET_FILTER)."""
        self.resets += 1
        self.n = 0
        self.offset_estimated = 0.0
        self.skew_estimated = 0.0
        self.alpha, self.beta = ALPHA_MAX, BETA_MAX
        self.high_deviation_count = 0
        self.high_rtt_count = 0

    def _take(self, offset_observed: float, rtt_us: float) -> None:
        if rtt_us >= MAX_RTT_US:
            self.high_rtt_count += 1
            return
        if self.converged and abs(self.offset_estimated - offset_observed) > MAX_DEVIATION_US:
            self.high_deviation_count += 1
            if self.high_deviation_count > MAX_CONSECUTIVE_HIGH_DEVIATION:
                self.reset_filter()
            return
        self.alpha, self.beta = gains(self.n)
        self._add_sample(offset_observed)
        self.n += 1
        self.high_deviation_count = 0
        self.high_rtt_count = 0

    def _add_sample(self, offset_observed: float) -> None:
        """Update offset and skew by one sample (Equations 2 and 3)."""
        before = self.offset_estimated
        if self.n == 0:
            self.offset_estimated = offset_observed
            return
        predicted = before + self.skew_estimated
        self.offset_estimated = self.alpha * offset_observed + (1 - self.alpha) * predicted
        moved = self.offset_estimated - before
        self.skew_estimated = self.beta * moved + (1 - self.beta) * self.skew_estimated


def gains(n: int) -> tuple[float, float]:
    """(α, β) after `n` samples, by Equations 7 to 9."""
    if n >= CONVERGENCE_WINDOW:
        return ALPHA_MIN, BETA_MIN
    p = 1 - math.exp(0.5 * (1 - 1 / (1 - n / CONVERGENCE_WINDOW)))
    return p * ALPHA_MIN + (1 - p) * ALPHA_MAX, p * BETA_MIN + (1 - p) * BETA_MAX
