"""Pulses, found and set to 0; see `phy.kernels.blanking`."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from phy.tables.blanking import BLOCK, DIP, LEVEL, LIMIT, REACH, RISE, WINDOW, WORTH


def blank(
    x: NDArray[np.complex64],
    n: int,
    before: float,
    _power: NDArray[np.float32],
    found: NDArray[np.uint8],
) -> float:
    """Set pulses in the first `n` blocks of `x` to 0; returns the level of the last of them."""
    powers = _powers(x, n + 1)
    levels = [before, *map(_level, powers)]
    for i in range(n):
        out = np.flatnonzero(_stands_out(powers[i], max(levels[i : i + 3])))
        found[i] = len(out) > 0
        block = x[i * BLOCK : (i + 1) * BLOCK]
        for pulse in np.split(out, np.flatnonzero(np.diff(out) > DIP) + 1) if len(out) else []:
            block[max(0, pulse[0] - REACH) : pulse[-1] + REACH + 1] = 0
    return levels[n]


def find_pulses(x: NDArray[np.complex64], _power: NDArray[np.float32]) -> bool:
    """Whether there are pulses in blocks of `x`, the first and the last one excepted."""
    windows = sliding_window_view(_powers(x, len(x) // BLOCK), WINDOW // BLOCK, axis=0)
    return any(_has_pulses(each.T) for each in windows[:: WINDOW // BLOCK - 2])


def _has_pulses(powers: NDArray[np.float32]) -> bool:
    """Whether one of the blocks but the first and the last has a pulse; powers `[8, BLOCK]`."""
    energy = powers.sum(axis=1)
    if energy.max() <= RISE * np.sort(energy)[2]:
        return False
    levels = [_level(each) for each in powers]
    inner = range(1, len(powers) - 1)
    return any(_stands_out(powers[i], max(levels[i - 1 : i + 2])).any() for i in inner)


def _powers(x: NDArray[np.complex64], n: int) -> NDArray[np.float32]:
    blocks = x[: n * BLOCK].reshape(n, BLOCK)
    return np.asarray(blocks.real**2 + blocks.imag**2)


def _level(power: NDArray[np.float32]) -> float:
    """Mean power of noise with this median; at least a step of a coarse converter."""
    least = power[power > 0].min(initial=np.inf)
    return max(LEVEL * float(np.sort(power)[BLOCK // 2]), float(least)) if power.any() else 0.0


def _stands_out(power: NDArray[np.float32], level: float) -> NDArray[np.bool_]:
    """The samples of a pulse in a block, if there is one that is worth them."""
    out = power > LIMIT * level
    return np.asarray(out & (power[out].sum() > WORTH * level))
