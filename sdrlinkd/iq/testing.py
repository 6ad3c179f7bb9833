"""What tests look at, piece by piece; not part of the interface."""

from types import ModuleType

from sdrlinkd.iq import keeper, stretches
from sdrlinkd.iq.finder import BurstFinder
from sdrlinkd.iq.replay import AHEAD_S, MOST_AHEAD
from sdrlinkd.iq.stretches import PAUSE, WINDOW

__all__ = [
    "AHEAD_S",
    "CONSTANTS",
    "MOST_AHEAD",
    "PAUSE",
    "WINDOW",
    "BurstFinder",
]

CONSTANTS: dict[str, tuple[ModuleType, str]] = {
    "least": (keeper, "LEAST"),
    "piece": (stretches, "PIECE"),
}
"""Constants that tests replace: `monkeypatch.setattr(*CONSTANTS["piece"], 32)`."""
