"""A simulated air that many nodes share: its world, its medium, its hub process and its radios."""

from backends.ether.antenna import Antenna
from backends.ether.hub import EtherHub
from backends.ether.local import LocalEther, LocalRadio, lockstep_capabilities
from backends.ether.medium import Medium, Piece
from backends.ether.protocol import Answer
from backends.ether.radio import EtherRadio
from backends.ether.watch import HubWatch
from backends.ether.world import (
    AirParams,
    Hop,
    LinkOverride,
    Outage,
    RadioParams,
    Track,
    World,
)

__all__ = [
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
    "lockstep_capabilities",
]
