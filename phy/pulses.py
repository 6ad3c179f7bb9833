"""A pulse of energy: it says that somebody is there, and nothing else."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from phy.sizes import N_PULSE

_RAMP = 8
_SWEEP = 0.35
"""Frequencies of the sweep, as a share of the sampling rate to each side of the carrier."""


@cache
def pulse() -> NDArray[np.complex64]:
    """The pulse's samples `[N_PULSE]`, complex64, of mean power 1 but for its soft edges.

    It sweeps through the band once. So its level is constant, a faded part of the band does not
    hide it, and nothing in it repeats, as it does in the preamble of a burst.
    """
    t = np.arange(N_PULSE)
    rate = 2 * _SWEEP / N_PULSE
    made = np.exp(2j * np.pi * (-_SWEEP * t + rate / 2 * t * t))
    edge = np.sin(np.pi / 2 * (np.arange(_RAMP) + 0.5) / _RAMP) ** 2
    made[:_RAMP] *= edge
    made[-_RAMP:] *= edge[::-1]
    samples = made.astype(np.complex64)
    samples.flags.writeable = False
    return samples
