"""Explains why the channel was idle while messages waited, by the access policy in force."""

from sdrlinkd.link.access.auto import Settled, percent
from sdrlinkd.link.access.minislot import MiniSlots

IDLE = 0.3
"""Share of idle time above which waiting messages do not wait for a busy channel."""
MORE = 1.25
"""Another policy is mentioned if it carries at least this many times as much."""
NOT_OTHERS = "messages wait for this radio, not for other robots"


def idle_words(settled: Settled | None, idle: float) -> str | None:
    """Why the channel was idle for the share `idle` of the time while messages waited.

    None if it was not idle. `settled` is the policy in force; None while there is no radio.
    """
    if idle < IDLE:
        return None
    why = NOT_OTHERS if settled is None else _why_idle(settled) + _what_is_better(settled)
    return f"the channel was idle {100 * idle:.0f} % of the time: {why}"


def _why_idle(settled: Settled) -> str:
    access = settled.access
    if isinstance(access, MiniSlots):
        return (
            f"minislot waits up to {1e3 * access.turn_s:.3g} ms after every burst on this radio "
            f"and leaves {percent(settled.share)} of the airtime usable"
        )
    if settled.policy == "auction":
        return (
            f"auction needs {1e3 * access.pause_s:.3g} ms after every burst on this radio, and "
            f"{1e3 * access.round_s:.3g} ms with a contest"
        )
    if settled.policy == "csma":
        waits = f"csma waits at least {1e3 * access.pause_s:.3g} ms after every burst"
        return f"{waits} on this radio and leaves {percent(settled.share)} of the airtime usable"
    if settled.policy == "tdma":
        own = 100 * access.share
        return (
            f"this robot owns {own:.2g} % of the {1e3 * access.round_s:.3g} ms schedule, and "
            "others left their slots unused"
        )
    if settled.policy == "grant":
        return f"this robot waited for its turns, in rounds of up to {1e3 * access.round_s:.3g} ms"
    return NOT_OTHERS


def _what_is_better(settled: Settled) -> str:
    best = settled.best
    if best == settled.policy or settled.shares[best] < MORE * settled.share:
        return ""
    times = settled.shares[best] / max(1e-6, settled.share)
    return f"; {best} would carry {times:.2g} times as much"
