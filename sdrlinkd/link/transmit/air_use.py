"""How full the air is, as far as one robot can tell, and what its policy makes of it."""

from sdrlinkd.link.access import MiniSlots, Settled, percent
from sdrlinkd.link.transmit.scheduler import BurstScheduler

IDLE = 0.3
"""An air that is idle for more than this while messages wait is not what they wait for."""
MORE = 1.25
"""A policy that carries so many times as much is worth naming."""


class AirUse:
    """Time on the air in s: ours, and that of the others' bursts that were heard."""

    def __init__(self, scheduler: BurstScheduler) -> None:
        self._scheduler = scheduler
        self.heard_s = 0.0
        self._heard_until = float("-inf")

    @property
    def sent_s(self) -> float:
        """Of our bursts that left."""
        return self._scheduler.airtime_s

    def heard(self, at: float, ended_at: float) -> None:
        """A PDU whose burst began at `at`; its own last sample came at `ended_at`."""
        self.heard_s += max(0.0, ended_at - max(at, self._heard_until))
        self._heard_until = max(self._heard_until, ended_at)

    def idle_words(self, idle: float) -> str | None:
        """Why it was idle for that share of the time while messages waited; None: it was not."""
        if idle < IDLE:
            return None
        settled = self._scheduler.settled
        return (
            f"the air was idle {100 * idle:.0f} % of the time: {_why_idle(settled)}"
            f"{_what_is_better(settled)}"
        )


def _why_idle(settled: Settled) -> str:
    access = settled.access
    if isinstance(access, MiniSlots):
        return (
            f"minislot waits up to {1e3 * access.turn_s:.3g} ms after every burst on this radio "
            f"and carries {percent(settled.share)} of the air"
        )
    if settled.policy == "csma":
        waits = f"csma waits {1e3 * access.pause_s:.3g} ms and more after every burst"
        return f"{waits} on this radio and carries {percent(settled.share)} of the air"
    if settled.policy == "tdma":
        own = 100 * access.share
        return (
            f"of the schedule's {1e3 * access.round_s:.3g} ms, {own:.2g} % are this robot's, and "
            "others left theirs unused"
        )
    return "what waits does not wait for others, but for this radio"


def _what_is_better(settled: Settled) -> str:
    best = settled.best
    if best == settled.policy or settled.shares[best] < MORE * settled.share:
        return ""
    times = settled.shares[best] / max(1e-6, settled.share)
    return f"; {best} would carry {times:.2g} times as much"
