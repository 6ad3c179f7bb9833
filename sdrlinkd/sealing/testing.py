"""What tests look at, piece by piece; not part of the interface."""

from types import ModuleType

from sdrlinkd.sealing import rotation
from sdrlinkd.sealing.ciphers import Ciphers
from sdrlinkd.sealing.rotation import QUIET_S

__all__ = [
    "CONSTANTS",
    "QUIET_S",
    "Ciphers",
]

CONSTANTS: dict[str, tuple[ModuleType, str]] = {
    "longest_s": (rotation, "LONGEST_S"),
}
"""Constants that tests replace: `monkeypatch.setattr(*CONSTANTS["longest_s"], 60.0)`."""
