"""FFTs of eight windows at once, one per lane.

The algorithm is Stockham's radix 4: every stage reads in order, and writes so that the last one's
output is sorted. Each value read or written is the same sample of all eight windows. So a stage
repeats the same few vector operations, for 64, 128 and 256 samples alike.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.inline import step
from phy.kernels.lanes import first_halves, load, second_halves, splat, store
from phy.sizes import N_LANES
from phy.tables.burst import Planes, Row, Scratch, Tones


@njit(nogil=True, cache=True, error_model="numpy")
def circle(frequency: float, size: float, out: Planes) -> None:
    """Write size · exp(j 2π · frequency · m) for m = 0, 1, … to `out` `[2, n]`."""
    step = complex(math.cos(2 * math.pi * frequency), math.sin(2 * math.pi * frequency))
    value = complex(size)
    for m in range(out.shape[1]):
        out[0, m], out[1, m] = value.real, value.imag
        value *= step


@njit(nogil=True, cache=True, error_model="numpy")
def eight_windows(
    samples: NDArray[np.complex64],
    starts: NDArray[np.int64],
    n: int,
    frequency: float,
    dc: complex,
    origin: int,
    tones: Tones,
    scratch: Scratch,
    out: NDArray[np.float32],
) -> None:
    """Run `windows_to_tones` on the first `n` ≤ 8 windows, with `scratch.turn` as it is."""
    n_fft, parts, square, turn = tones.n_fft, scratch.windows, scratch.square, scratch.turn
    flat, step = samples.view(np.float32), -2 * math.pi * frequency
    re, im, to_re, to_im = parts[0], parts[1], parts[2], parts[3]
    for lane in range(N_LANES):
        # Unused lanes repeat the last window, so nothing beyond the samples is read.
        phase = step * (starts[min(lane, n - 1)] + origin)
        square[lane], square[N_LANES + lane] = math.cos(phase), math.sin(phase)
    begin_re, begin_im = load(square, 0), load(square, N_LANES)
    offset_re, offset_im = splat(dc.real), splat(dc.imag)
    for m in range(0, n_fft, N_LANES // 2):
        for lane in range(N_LANES):
            store(square, N_LANES * lane, load(flat, 2 * (starts[min(lane, n - 1)] + m)))
        transpose(square)
        for i in range(N_LANES // 2):
            a = load(square, 2 * N_LANES * i) - offset_re
            b = load(square, 2 * N_LANES * i + N_LANES) - offset_im
            c, s = splat(turn[0, m + i]), splat(turn[1, m + i])
            by_re, by_im = c * begin_re - s * begin_im, c * begin_im + s * begin_re
            store(re, N_LANES * (m + i), a * by_re - b * by_im)
            store(im, N_LANES * (m + i), a * by_im + b * by_re)
    if transform(re, im, to_re, to_im, n_fft, tones.twiddles):
        re, im = to_re, to_im
    _sort(re, im, n, tones.bins, square, out)


@njit(nogil=True, cache=True, error_model="numpy")
def windows_to_tones(
    samples: NDArray[np.complex64],
    starts: NDArray[np.int64],
    frequency: float,
    dc: complex,
    origin: int,
    tones: Tones,
    scratch: Scratch,
    out: NDArray[np.float32],
) -> None:
    """Write the tones `[n, 2, width]` of FFT windows that begin at `starts` `[n]`.

    Before the FFT, `dc` is subtracted from the samples and they are rotated back by `frequency`
    cycles per sample; phase 0 is `origin` samples before `samples[0]`.
    """
    circle(-frequency, tones.gain, scratch.turn)
    for row in range(0, starts.size, N_LANES):
        n = min(starts.size - row, N_LANES)
        eight_windows(samples, starts[row:], n, frequency, dc, origin, tones, scratch, out[row:])


@step
def transpose(square: Row) -> None:
    """Transpose eight rows of eight in place by three perfect shuffles."""
    a, b, c, d = load(square, 0), load(square, 8), load(square, 16), load(square, 24)
    e, f, g, h = load(square, 32), load(square, 40), load(square, 48), load(square, 56)
    for _ in range(3):
        a, b, c, d, e, f, g, h = (
            first_halves(a, e), second_halves(a, e), first_halves(b, f), second_halves(b, f),
            first_halves(c, g), second_halves(c, g), first_halves(d, h), second_halves(d, h),
        )  # fmt: skip
    store(square, 0, a)
    store(square, 8, b)
    store(square, 16, c)
    store(square, 24, d)
    store(square, 32, e)
    store(square, 40, f)
    store(square, 48, g)
    store(square, 56, h)


@njit(nogil=True, cache=True, error_model="numpy")
def _sort(
    re: Row, im: Row, n: int, bins: NDArray[np.int64], square: Row, out: NDArray[np.float32]
) -> None:
    """Write the first `n` lanes to rows of `out` `[…, 2, width]`, in the order of `bins`."""
    width = out.shape[2]
    for part in range(2):
        of = im if part else re
        for first in range(0, width, N_LANES):
            for i in range(N_LANES):
                inside = first + i < bins.size
                value = load(of, N_LANES * bins[first + i]) if inside else splat(0.0)
                store(square, N_LANES * i, value)
            transpose(square)
            for lane in range(n):
                store(out, (2 * lane + part) * width + first, load(square, N_LANES * lane))


@njit(nogil=True, cache=True, error_model="numpy")
def transform(
    re: Row, im: Row, to_re: Row, to_im: Row, n: int, twiddles: NDArray[np.float32]
) -> bool:
    """Compute the FFT of lanes `[n · 8]`; True if the result is in `to_re`, `to_im`."""
    left, swapped = n, False
    stride: Any = np.int64(1)
    while left >= 4:
        left //= 4
        if swapped:
            _radix_4(to_re, to_im, re, im, left, stride, twiddles)
        else:
            _radix_4(re, im, to_re, to_im, left, stride, twiddles)
        swapped = not swapped
        stride *= 4
    if left == 2:
        if swapped:
            _radix_2(to_re, to_im, re, im, stride)
        else:
            _radix_2(re, im, to_re, to_im, stride)
        swapped = not swapped
    return swapped


@njit(nogil=True, cache=True, error_model="numpy")
def _radix_4(
    re: Row, im: Row, to_re: Row, to_im: Row, n: int, stride: int, twiddles: NDArray[np.float32]
) -> None:
    """Run a radix-4 stage: `n` groups of `stride` butterflies."""
    quarter = N_LANES * n * stride
    for j in range(n):
        at = j * stride
        w1_re, w1_im = splat(twiddles[0, at]), splat(twiddles[1, at])
        w2_re, w2_im = splat(twiddles[0, 2 * at]), splat(twiddles[1, 2 * at])
        w3_re, w3_im = splat(twiddles[0, 3 * at]), splat(twiddles[1, 3 * at])
        for k in range(stride):
            a = N_LANES * (at + k)
            b, c, d = a + quarter, a + 2 * quarter, a + 3 * quarter
            even_re, even_im = load(re, a) + load(re, c), load(im, a) + load(im, c)
            less_re, less_im = load(re, a) - load(re, c), load(im, a) - load(im, c)
            odd_re, odd_im = load(re, b) + load(re, d), load(im, b) + load(im, d)
            # (b − d) · −j
            turn_re, turn_im = load(im, b) - load(im, d), load(re, d) - load(re, b)
            to = N_LANES * (4 * at + k)
            store(to_re, to, even_re + odd_re)
            store(to_im, to, even_im + odd_im)
            x_re, x_im = less_re + turn_re, less_im + turn_im
            to += N_LANES * stride
            store(to_re, to, x_re * w1_re - x_im * w1_im)
            store(to_im, to, x_re * w1_im + x_im * w1_re)
            x_re, x_im = even_re - odd_re, even_im - odd_im
            to += N_LANES * stride
            store(to_re, to, x_re * w2_re - x_im * w2_im)
            store(to_im, to, x_re * w2_im + x_im * w2_re)
            x_re, x_im = less_re - turn_re, less_im - turn_im
            to += N_LANES * stride
            store(to_re, to, x_re * w3_re - x_im * w3_im)
            store(to_im, to, x_re * w3_im + x_im * w3_re)


@njit(nogil=True, cache=True, error_model="numpy")
def _radix_2(re: Row, im: Row, to_re: Row, to_im: Row, stride: int) -> None:
    """Run the last stage for sizes that are not a power of 4."""
    half = N_LANES * stride
    for a in range(0, half, N_LANES):
        b = a + half
        store(to_re, a, load(re, a) + load(re, b))
        store(to_im, a, load(im, a) + load(im, b))
        store(to_re, b, load(re, a) - load(re, b))
        store(to_im, b, load(im, a) - load(im, b))
