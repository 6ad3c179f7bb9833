"""Compiled loops: the code that must be fast. The rest of the modem reads like the equations."""

from phy.kernels import cache as cache
