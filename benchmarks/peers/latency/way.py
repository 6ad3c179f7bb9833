"""What there is between two ends."""

from collections.abc import Callable
from typing import NamedTuple

from benchmarks.peers.latency.job import Address
from sdrlinkd.process import Process


class End(NamedTuple):
    """Where one endpoint is joined up, and by which interpreter it runs; see `environments`."""

    address: Address
    environment: str = ""


def no_line() -> list[float]:
    """An emulated line that is none, for ways that need none."""
    return []


class Way(NamedTuple):
    """What there is from end to end, up and running."""

    ends: dict[str, End]
    """Of "companion" and "fcu"."""
    between: list[Process]
    """Processes whose load counts too."""
    line_late_s: Callable[[], list[float]] = no_line
    """Called once, in the end."""
