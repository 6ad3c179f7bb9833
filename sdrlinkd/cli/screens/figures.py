"""Formats figures in the same way on all screens."""

from sdrlinkd.reports import ClockReport
from sdrlinkd.tables import NOTHING

BLOCKS = "▁▂▃▄▅▆▇█"


def milliseconds(value: float | None) -> str:
    """An age or a delay in ms as text, with decimals below 100."""
    if value is None:
        return NOTHING
    return f"{value:.2f}" if value < 100 else f"{value:.0f}"


def duration(seconds: float) -> str:
    """A time span, given in s, as text for people."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    if seconds < 3600:
        return f"{int(seconds // 60)} min {int(seconds % 60)} s"
    return f"{int(seconds // 3600)} h {int(seconds % 3600 // 60)} min"


def size(n_bytes: float) -> str:
    """A number of bytes with its unit."""
    for unit, scale in (("MB", 10**6), ("kB", 10**3)):
        if n_bytes >= scale:
            return f"{n_bytes / scale:.1f} {unit}"
    return f"{n_bytes:.0f} B"


def rate(per_s: float) -> str:
    """A rate per second; empty for 0."""
    return f"{per_s:.1f}" if per_s else NOTHING


def bytes_rate(per_s: float) -> str:
    """A rate in bytes per second; empty for 0."""
    return f"{size(per_s)}/s" if per_s else NOTHING


def decibels(value: float | None) -> str:
    """A level or a ratio in dB."""
    return NOTHING if value is None else f"{value:.1f}"


def hertz(value: float | None) -> str:
    """A frequency in Hz."""
    return NOTHING if value is None else f"{value:.0f}"


def percent(share: float | None, digits: int = 1) -> str:
    """A share from 0 to 1, in %."""
    return NOTHING if share is None else f"{100 * share:.{digits}f}"


def clock_state(clock: ClockReport) -> str:
    """How well another robot's clock is known."""
    if clock.wall_bound_us is None or clock.state == "unsynced":
        return clock.state
    return f"{clock.state}, ± {milliseconds(clock.wall_bound_us / 1e3)} ms"


def sparkline(values: list[float | None], low: float, high: float, width: int) -> str:
    """The last `width` values as small bars between `low` and `high`; None leaves a gap."""
    drawn = []
    for value in values[-width:]:
        if value is None:
            drawn.append(" ")
            continue
        share = (value - low) / (high - low) if high > low else 0.0
        drawn.append(BLOCKS[min(max(int(share * len(BLOCKS)), 0), len(BLOCKS) - 1)])
    return "".join(drawn).rjust(width)
