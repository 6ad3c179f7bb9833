"""Everything between two ends."""

import json
from collections.abc import Callable
from typing import NamedTuple

from benchmarks.peers.latency.job import Address
from sdrlinkd.process import Process


class End(NamedTuple):
    """How one endpoint is connected, and its interpreter; see `environments`."""

    address: Address
    environment: str = ""


def no_line() -> list[float]:
    """No delays: for ways without an emulated line."""
    return []


def late_s(line: Process) -> list[float]:
    """The delays that the process of an emulated line reports at its end."""
    line.close_input()
    late_s: list[float] = json.loads(line.line())
    return late_s


class Way(NamedTuple):
    """A running connection from end to end."""

    ends: dict[str, End]
    """The ends of "companion" and "fcu"."""
    between: list[Process]
    """Processes whose load counts as well."""
    line_late_s: Callable[[], list[float]] = no_line
    """Delays of the emulated line; called once, at the end."""
