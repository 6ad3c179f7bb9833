"""A simulated air that many nodes share: its world, its medium, its hub process and its radios.

What computes samples needs compiled code and is loaded on first use: a program that only asks a
hub never loads it.
"""

import importlib
from typing import TYPE_CHECKING

from backends.ether.pace import hub_keeps_pace
from backends.ether.protocol import Answer
from backends.ether.watch import HubWatch
from backends.ether.world import (
    SPEED_OF_LIGHT,
    AirParams,
    Hop,
    LinkOverride,
    Outage,
    RadioParams,
    Track,
    World,
)

if TYPE_CHECKING:
    from backends.ether.antenna import Antenna
    from backends.ether.ear import Piece
    from backends.ether.hub import EtherHub
    from backends.ether.local import LocalEther, LocalRadio, lockstep_capabilities
    from backends.ether.medium import Medium
    from backends.ether.radio import EtherRadio

__all__ = [
    "SPEED_OF_LIGHT",
    "AirParams",
    "Answer",
    "Antenna",
    "EtherHub",
    "EtherRadio",
    "Hop",
    "HubWatch",
    "LinkOverride",
    "LocalEther",
    "LocalRadio",
    "Medium",
    "Outage",
    "Piece",
    "RadioParams",
    "Track",
    "World",
    "hub_keeps_pace",
    "lockstep_capabilities",
]

_LATER = {
    "Antenna": "antenna",
    "EtherHub": "hub",
    "EtherRadio": "radio",
    "LocalEther": "local",
    "LocalRadio": "local",
    "Medium": "medium",
    "Piece": "ear",
    "lockstep_capabilities": "local",
}


def __getattr__(name: str) -> object:
    """Import an attribute on first use (PEP 562)."""
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"backends.ether.{_LATER[name]}"), name)
