"""Compiled loops. Everything outside reads like the equations; what must be fast is here."""

from phy.kernels import cache as cache
