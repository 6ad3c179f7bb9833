"""A simulated robot: its link, and the few parts of a modem that it needs."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from benchmarks.worlds.arrivals import Arrival
from sdrlinkd.link import Link, PduLinkTraits, Settled

INFINITE = float("inf")


@dataclass(slots=True, eq=False)
class Station:
    """A robot: its link, and the few parts of a modem that it needs."""

    link: Link
    traits: PduLinkTraits
    settled: Settled
    pace: float
    """Rate of its own crystal, by which its link counts time."""
    arrivals: Iterator[Arrival]
    least_s: float
    """Least duration of a burst with what follows it."""
    look_at: float = INFINITE
    """The next block at which to query the link."""
    free_at: float = 0.0
    ticked_at: float = 0.0
    sent: Counter[int] = field(default_factory=Counter)
    """Number of messages handed over, by topic id."""
    bursts: int = 0
