"""Finds lines in the spectrum of overlapping windows, and takes them out.

A window is judged by itself, so that a line that sweeps through the band is found in each of them.
Eight windows are transformed at once, one per lane; each gives the same whatever the others are.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.fft import transform, transpose
from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, load, most, pairs, splat, store
from phy.kernels.medians import median
from phy.kernels.openers import open_notch
from phy.sizes import N_LANES
from phy.tables.block import PackedArguments
from phy.tables.notch import LINE_DB, MOST_CUT, SIZE, STRIDE, NotchMemory

_LINE = 10 ** (LINE_DB / 10)
# A window whose strongest bin has less than this times the mean of all has no line.
_EVEN = 10.0


@njit(nogil=True, cache=True, error_model="numpy")
def find_lines(
    x: NDArray[np.complex64],
    n: int,
    apart: int,
    memory_in: PackedArguments,
    cut: NDArray[np.uint8],
) -> int:
    """Number of the first of `n` ≤ 8 windows of `x`, `apart` samples apart, with lines, or −1.

    Its bins that are lines are 1 in `cut` `[8, SIZE]`.
    """
    memory = open_notch(memory_in)
    swapped = _spectra(x, n, apart, memory)
    for lane in range(n):
        if _judge(lane, swapped, memory, cut[lane]) > 0:
            return lane
    return -1


@njit(nogil=True, cache=True, error_model="numpy")
def cut_lines(
    x: NDArray[np.complex64],
    n: int,
    memory_in: PackedArguments,
    out: NDArray[np.complex64],
    cut: NDArray[np.uint8],
    found: NDArray[np.int64],
) -> None:
    """Write the first halves of `n` ≤ 8 windows of `x`, STRIDE apart, to `out`, without lines.

    DC goes, too, and with it a line that is too near to 0 to be told from it. `cut` `[8, SIZE]`
    gets 1 for each bin that was cut, `found` `[8]` how many there are in each window; −1: too many,
    and none was cut.
    """
    memory = open_notch(memory_in)
    swapped = _spectra(x, n, STRIDE, memory)
    planes, window, tail = memory.planes, memory.window, memory.tail
    re, im = (planes[2], planes[3]) if swapped else (planes[0], planes[1])
    to_re, to_im = (planes[0], planes[1]) if swapped else (planes[2], planes[3])
    for lane in range(n):
        found[lane] = _judge(lane, swapped, memory, cut[lane])
        if found[lane] > 0:
            for k in range(SIZE):
                if cut[lane, k]:
                    re[N_LANES * k + lane] = im[N_LANES * k + lane] = 0
    # An FFT with both parts exchanged is the inverse, times SIZE.
    if transform(im, re, to_im, to_re, SIZE, memory.twiddles):
        re, im = to_re, to_im
    share = np.float32(1 / SIZE)
    for lane in range(n):
        for m in range(STRIDE):
            at, w = N_LANES * m + lane, window[m] * share
            a, b = tail[0, m] + w * re[at], tail[1, m] + w * im[at]
            out[STRIDE * lane + m] = complex(a, b)
        for m in range(STRIDE):
            at, w = N_LANES * (STRIDE + m) + lane, window[STRIDE + m] * share
            tail[0, m], tail[1, m] = w * re[at], w * im[at]


@step
def _spectra(x: NDArray[np.complex64], n: int, apart: int, memory: NotchMemory) -> bool:
    """Write the windows' spectra to the planes; True: to the second pair.

    They are without DC, which is no line: a receiver takes it out by itself. `square` gets the sum
    of each window's powers, and behind these the largest of each.
    """
    planes, square, window, weights = memory.planes, memory.square, memory.window, memory.weights
    flat, constant = x.view(np.float32), memory.constant
    for lane in range(N_LANES):
        # Unused lanes repeat the last window, so nothing beyond the samples is read.
        begin = 2 * min(lane, n - 1) * apart
        total: Lanes = splat(0)
        for i in range(begin, begin + 2 * SIZE, N_LANES):
            total = total + load(flat, i) * load(weights, i - begin)
        mean = complex(pairs(total))
        square[lane], square[N_LANES + lane] = mean.real, mean.imag
    mean_re, mean_im = load(square, 0), load(square, N_LANES)
    for m in range(0, SIZE, N_LANES // 2):
        for lane in range(N_LANES):
            store(square, N_LANES * lane, load(flat, 2 * (min(lane, n - 1) * apart + m)))
        transpose(square)
        for i in range(N_LANES // 2):
            w = splat(window[m + i])
            store(planes[0], N_LANES * (m + i), load(square, 2 * N_LANES * i) * w)
            store(planes[1], N_LANES * (m + i), load(square, 2 * N_LANES * i + N_LANES) * w)
    swapped = transform(planes[0], planes[1], planes[2], planes[3], SIZE, memory.twiddles)
    at_re, at_im = (planes[2], planes[3]) if swapped else (planes[0], planes[1])
    sums: Lanes = splat(0)
    largest: Lanes = splat(0)
    for k in range(SIZE):
        c, d = splat(constant[0, k]), splat(constant[1, k])
        a = load(at_re, N_LANES * k) - (mean_re * c - mean_im * d)
        b = load(at_im, N_LANES * k) - (mean_re * d + mean_im * c)
        store(at_re, N_LANES * k, a)
        store(at_im, N_LANES * k, b)
        power: Lanes = a * a + b * b
        sums, largest = sums + power, most(largest, power)
    store(square, 0, sums)
    store(square, N_LANES, largest)
    return swapped


@step
def _judge(lane: int, swapped: bool, memory: NotchMemory, cut: NDArray[np.uint8]) -> int:
    """Mark the bins of a window to cut; returns their number, or −1 if they are too many."""
    power, mean = memory.power, float(memory.square[lane]) / SIZE
    cut[:] = 0
    if not memory.square[N_LANES + lane] > _EVEN * mean:
        return 0
    planes = memory.planes
    re, im = (planes[2], planes[3]) if swapped else (planes[0], planes[1])
    for k in range(SIZE):
        a, b = re[N_LANES * k + lane], im[N_LANES * k + lane]
        power[k] = a * a + b * b
    limit, n = np.float32(_LINE * median(power, mean)), 0
    for k in range(SIZE):
        if power[k] > limit:
            cut[k] = cut[(k + 1) % SIZE] = cut[k - 1] = 1
    for k in range(SIZE):
        n += cut[k]
    if n > MOST_CUT:
        cut[:] = 0
        return -1
    return n
