"""What tests look at, piece by piece; not part of the interface."""

from types import ModuleType

from sdrlinkd.bus import undropped
from sdrlinkd.bus.announcement import announcement
from sdrlinkd.bus.envelope import OutHeader, decode, encode, wanted_of
from sdrlinkd.bus.handed import header_of
from sdrlinkd.bus.intake import Intake
from sdrlinkd.bus.retained import Retained, Retention
from sdrlinkd.bus.undropped import Undropped

__all__ = [
    "CONSTANTS",
    "Intake",
    "OutHeader",
    "Retained",
    "Retention",
    "Undropped",
    "announcement",
    "decode",
    "encode",
    "header_of",
    "wanted_of",
]

CONSTANTS: dict[str, tuple[ModuleType, str]] = {
    "stuck_s": (undropped, "STUCK_S"),
}
"""Constants that tests replace: `monkeypatch.setattr(*CONSTANTS["stuck_s"], 0.0)`."""
