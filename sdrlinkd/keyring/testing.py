"""What tests look at, piece by piece; not part of the interface."""

from types import ModuleType

from sdrlinkd.keyring import making, state

__all__ = [
    "CONSTANTS",
]

CONSTANTS: dict[str, tuple[ModuleType, str]] = {
    "machine_id": (state, "MACHINE_ID"),
    "boot_id": (state, "BOOT_ID"),
    "is_synchronized": (making, "is_synchronized"),
}
"""What tests replace: `monkeypatch.setattr(*CONSTANTS["machine_id"], path)`."""
