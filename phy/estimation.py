"""The channel as the training symbols tell it.

Window convention: every FFT window begins BACKOFF samples before the first echo, so that echoes a
little earlier than it stay inside the prefix; the channel estimate holds the resulting slope.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.kernels.training import least_squares, transform
from phy.numerology import Numerology

BACKOFF = 3

# Echoes that the smoother expects, in samples after the window's prefix begins to count.
_FIRST_TAP, _LAST_TAP = 0, 18
# Share of the power that may lie anywhere: keeps the smoother honest at high SNR.
_LEAK = 1e-3
_SNR_FIRST_DB, _SNR_STEP_DB, _N_SNR_STEPS = -6, 3, 16


class ChannelEstimate(NamedTuple):
    """Gains of the carriers in use `[n_used]`, noise power on a carrier, and mean |h|²."""

    h_hat: NDArray[np.complex64]
    no: float
    gain: float


def estimate(
    bins: NDArray[np.complex64], sent: NDArray[np.complex64], grid: Numerology
) -> ChannelEstimate:
    """From `n` ≥ 2 known symbols: FFT bins `[n, n_fft]`, `sent` `[n, n_used]` of magnitude 1.

    Least squares, then the linear MMSE smoother for echoes within the prefix.
    """
    n = len(bins)
    rough = np.empty(grid.n_used, np.complex64)
    no, power = least_squares(bins, grid.bins, sent, rough)
    no = max(no, 1e-20)
    gain = max(power - no / n, 1e-3 * power, 1e-20)
    snr_db = 10 * math.log10(gain / no * n)
    step = round((snr_db - _SNR_FIRST_DB) / _SNR_STEP_DB)
    step = min(max(step, 0), _N_SNR_STEPS - 1)
    return ChannelEstimate(transform(_smoothers(grid)[step], rough), no, gain)


@cache
def _smoothers(grid: Numerology) -> list[NDArray[np.complex64]]:
    """W = R (R + I / snr)⁻¹ for each SNR of the least-squares estimate `[n_used, n_used]`."""
    taps = np.arange(_FIRST_TAP, _LAST_TAP + 1)
    difference = grid.used[:, None] - grid.used[None, :]
    turns = np.exp(-2j * np.pi * difference[..., None] * taps / grid.n_fft).mean(axis=-1)
    r = (1 - _LEAK) * turns + _LEAK * np.eye(grid.n_used)
    return [
        (r @ np.linalg.inv(r + np.eye(grid.n_used) * 10 ** (-snr_db / 10))).astype(np.complex64)
        for snr_db in _SNR_FIRST_DB + _SNR_STEP_DB * np.arange(_N_SNR_STEPS)
    ]
