"""What tests look at, piece by piece; not part of the interface."""

from types import ModuleType

from sdrlinkd.adapters import mcap_bag
from sdrlinkd.adapters.robot import ROOM_HALF_M, Pose
from sdrlinkd.adapters.salvage import sqlite
from sdrlinkd.adapters.typestore import ros2_types

__all__ = [
    "CONSTANTS",
    "ROOM_HALF_M",
    "Pose",
    "ros2_types",
]

CONSTANTS: dict[str, tuple[ModuleType, str]] = {
    "most_in_chunk": (mcap_bag, "MOST_BYTES"),
    "most_steps": (sqlite, "MOST_STEPS"),
}
"""Constants that tests replace: `monkeypatch.setattr(*CONSTANTS["most_steps"], 1 << 22)`."""
