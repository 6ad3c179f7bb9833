"""Simulates, from a seed, what happens to samples between a transmitter and a receiver."""

from phy.channel.front_end import FrontEnd, FrontEndParams
from phy.channel.jammer import Jammer
from phy.channel.path import Path, PathParams
from phy.channel.profiles import PROFILES

__all__ = ["PROFILES", "FrontEnd", "FrontEndParams", "Jammer", "Path", "PathParams"]
