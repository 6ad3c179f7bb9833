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
from phy.tables.notch import CLOSE, DC_BACK, LINE_DB, MOST_CUT, SEED_DB, SIZE, STRIDE, NotchMemory

_SEED, _LINE = 10 ** (SEED_DB / 10), 10 ** (LINE_DB / 10)
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
    found = -1
    for lane in range(n):
        if _judge(lane, swapped, memory, cut[lane]) > 0:
            found = lane
            break
    # Of windows so far apart, none continues another.
    memory.held[:] = 0
    return found


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

    With lines and soon after them, DC goes, too, and with it a line too near to 0 to be told from
    it. `cut` `[8, SIZE]` gets 1 for each bin that was cut, `found` `[8]` how many there are in each
    window; −1: too many, and none was cut.
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
            memory.quiet[0] = 0
        elif memory.quiet[0] < DC_BACK:
            memory.quiet[0] += 1
        else:
            mean_re, mean_im = memory.square[2 * N_LANES + lane], memory.square[3 * N_LANES + lane]
            for k in range(SIZE):
                c, d = memory.constant[0, k], memory.constant[1, k]
                re[N_LANES * k + lane] += mean_re * c - mean_im * d
                im[N_LANES * k + lane] += mean_re * d + mean_im * c
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

    They are without DC, which is no line: a receiver takes it out by itself. `square` gets, for
    each window, the sum of its powers, the largest, and the real and the imaginary part of its DC.
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
    store(square, 2 * N_LANES, mean_re)
    store(square, 3 * N_LANES, mean_im)
    return swapped


@step
def _judge(lane: int, swapped: bool, memory: NotchMemory, cut: NDArray[np.uint8]) -> int:
    """Mark the bins of a window to cut; returns their number, or −1 if they are too many."""
    power, mean = memory.power, float(memory.square[lane]) / SIZE
    cut[:] = 0
    if not memory.square[N_LANES + lane] > _EVEN * mean:
        memory.held[:] = 0
        return 0
    planes = memory.planes
    re, im = (planes[2], planes[3]) if swapped else (planes[0], planes[1])
    for k in range(SIZE):
        a, b = re[N_LANES * k + lane], im[N_LANES * k + lane]
        power[k] = a * a + b * b
    middle = median(power, mean)
    seed, limit = np.float32(_SEED * middle), np.float32(_LINE * middle)
    for k in range(SIZE):
        if power[k] > seed or (power[k] > limit and memory.held[k]):
            _spread(k, 1, limit, power, cut)
            _spread(k, -1, limit, power, cut)
    n = 0
    for k in range(SIZE):
        with_neighbors = cut[k - 1] | cut[k] | cut[(k + 1) % SIZE]
        memory.held[k] = with_neighbors
        n += with_neighbors
    if n > MOST_CUT:
        cut[:] = 0
        memory.held[:] = 0
        return -1
    for k in range(SIZE):
        cut[k] = memory.held[k]
    return n


@step
def _spread(
    k: int, way: int, limit: np.float32, power: NDArray[np.float32], cut: NDArray[np.uint8]
) -> None:
    """Mark a line at bin `k`, and others close to it, from one to the next."""
    cut[k], gap = 1, 0
    for _ in range(SIZE):
        k = (k + way) % SIZE
        gap += 1
        if cut[k] or gap > CLOSE:
            return
        if power[k] > limit:
            cut[k], gap = 1, 0
