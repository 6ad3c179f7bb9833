"""Finds pulses: a few samples that stand out of the blocks before, at and behind them.

Levels are medians, which pulses shorter than half of a block do not move. The begin of a burst does
not stand out, since the block behind it has its level, nor does its end.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, load, pairs, splat
from phy.kernels.medians import median
from phy.sizes import N_LANES
from phy.tables.blanking import BLOCK, DIP, LEVEL, LIMIT, REACH, RISE, WINDOW, WORTH

_N_BLOCKS = WINDOW // BLOCK
# Of the blocks of a window, so many are quieter than what a pulse is compared with.
_QUIETER = 2


@njit(nogil=True, cache=True, error_model="numpy")
def blank(
    x: NDArray[np.complex64],
    n: int,
    before: float,
    power: NDArray[np.float32],
    found: NDArray[np.uint8],
) -> float:
    """Set pulses in the first `n` blocks of `x` to 0; the one behind them is there to compare.

    `before` is the level of the block before, as the previous call returned it. `found` `[n]` gets
    1 for each block with a pulse, else 0. `power` `[BLOCK]` is working memory.
    """
    here = _level(x[:BLOCK], power)
    for i in range(n):
        at = i * BLOCK
        behind = _level(x[at + BLOCK : at + 2 * BLOCK], power)
        block = x[at : at + BLOCK]
        level = max(before, here, behind)
        found[i] = _has_pulse(block, level, power)
        if found[i]:
            _zero(block, level, power)
        before, here = here, behind
    return before


@njit(nogil=True, cache=True, error_model="numpy")
def find_pulses(x: NDArray[np.complex64], power: NDArray[np.float32]) -> bool:
    """Whether there are pulses in blocks of `x`, the first and the last one excepted.

    `x` is whole windows, of which the last two blocks are the first ones of the next.
    """
    for begin in range(0, x.size - 2 * BLOCK, WINDOW - 2 * BLOCK):
        window = x[begin : begin + WINDOW]
        if _rises(window, power):
            before, here = _level(window[:BLOCK], power), _level(window[BLOCK : 2 * BLOCK], power)
            for at in range(BLOCK, WINDOW - BLOCK, BLOCK):
                behind = _level(window[at + BLOCK : at + 2 * BLOCK], power)
                block = window[at : at + BLOCK]
                if _has_pulse(block, max(before, here, behind), power):
                    return True
                before, here = here, behind
    return False


@step
def _rises(window: NDArray[np.complex64], energy: NDArray[np.float32]) -> bool:
    """Whether a block has clearly more energy than most: a quick look, for most windows the last.

    The energies of the blocks are written to `energy`.
    """
    flat, most = window.view(np.float32), np.float32(0)
    for i in range(_N_BLOCKS):
        sums: Lanes = splat(0)
        for k in range(2 * i * BLOCK, 2 * (i + 1) * BLOCK, N_LANES):
            each = load(flat, k)
            sums = sums + each * each
        total = complex(pairs(sums))
        energy[i] = total.real + total.imag
        most = max(most, energy[i])
    for i in range(_N_BLOCKS):
        less, equal = 0, 0
        for k in range(_N_BLOCKS):
            less += energy[k] < energy[i]
            equal += energy[k] == energy[i]
        if less <= _QUIETER < less + equal:
            return bool(most > RISE * energy[i])
    return False


@step
def _level(block: NDArray[np.complex64], power: NDArray[np.float32]) -> float:
    """Mean power of noise with the median of a block; at least a step of a coarse converter."""
    total, least = np.float32(0), np.float32(np.inf)
    for i in range(BLOCK):
        a, b = block[i].real, block[i].imag
        p = a * a + b * b
        power[i] = p
        total += p
        if p > 0:
            least = min(least, p)
    if total == 0:
        return 0.0
    return max(LEVEL * median(power, float(total) / BLOCK), float(least))


@step
def _has_pulse(block: NDArray[np.complex64], level: float, power: NDArray[np.float32]) -> bool:
    """Whether what stands out of a block has more energy than is worth its samples.

    The powers of its samples are written to `power`.
    """
    limit, energy = np.float32(LIMIT * level), np.float32(0)
    for i in range(BLOCK):
        a, b = block[i].real, block[i].imag
        power[i] = a * a + b * b
        if power[i] > limit:
            energy += power[i]
    return bool(energy > WORTH * level)


@step
def _zero(block: NDArray[np.complex64], level: float, power: NDArray[np.float32]) -> None:
    """Set samples whose `power` stands out of a block to 0, and those near them."""
    limit, last = np.float32(LIMIT * level), -BLOCK
    for i in range(BLOCK):
        if power[i] > limit:
            begin = last if i - last <= DIP else max(0, i - REACH)
            for k in range(begin, min(i + REACH + 1, BLOCK)):
                block[k] = 0
            last = i
