"""What tests look at, piece by piece; not part of the interface."""

from types import ModuleType

from sdrlinkd.sealing import rotation
from sdrlinkd.sealing.ciphers import Ciphers
from sdrlinkd.sealing.contacts import Contacts
from sdrlinkd.sealing.held_keys import HeldKeys
from sdrlinkd.sealing.numbers import Numbers
from sdrlinkd.sealing.peers import Least, Peer, Peers, Proof, Window
from sdrlinkd.sealing.rotation import QUIET_S, Rotation
from sdrlinkd.sealing.strangers import Strangers

__all__ = [
    "CONSTANTS",
    "QUIET_S",
    "Ciphers",
    "Contacts",
    "HeldKeys",
    "Least",
    "Numbers",
    "Peer",
    "Peers",
    "Proof",
    "Rotation",
    "Strangers",
    "Window",
]

CONSTANTS: dict[str, tuple[ModuleType, str]] = {
    "longest_s": (rotation, "LONGEST_S"),
}
"""Constants that tests replace: `monkeypatch.setattr(*CONSTANTS["longest_s"], 60.0)`."""
