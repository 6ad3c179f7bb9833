"""A simulated air that many nodes share: its world, its medium, a hub process, its radios."""

from backends.ether.burst_channel import AirSense, BurstChannel
from backends.ether.flight import BurstShape, Flight, burst_shape
from backends.ether.hub import EtherHub
from backends.ether.local import LocalEther, LocalRadio
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
    "AirSense",
    "Answer",
    "BurstChannel",
    "BurstShape",
    "EtherHub",
    "EtherRadio",
    "Flight",
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
    "burst_shape",
]
