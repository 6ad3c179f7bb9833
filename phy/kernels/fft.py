"""FFTs of eight windows at once, one in each lane.

Stockham's radix 4: every stage reads in order, and writes so that the last one's output is sorted.
What is read and written are eight windows' samples of the same number; so a stage is the same few
vector operations again and again, for 64, 128 and 256 samples alike.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.lanes import N_LANES, first_halves, load, second_halves, splat, store

Row = NDArray[np.float32]


@njit(nogil=True, cache=True)
def to_tones(
    samples: NDArray[np.complex64],
    starts: NDArray[np.int64],
    frequency: float,
    origin: int,
    dc: complex,
    gain: float,
    n_fft: int,
    bins: NDArray[np.int64],
    out: NDArray[np.float32],
) -> None:
    """FFT `bins` `[n_used]` of windows of `n_fft` samples, real and imaginary parts.

    `out` is `[n, 2, width]`, n_used up to whole lanes. Samples are taken less `dc`, turned back by
    `frequency` cycles a sample, times `gain`; phase 0 is `origin` samples before `samples[0]`.
    """
    flat = samples.view(np.float32)
    parts = np.empty((4, N_LANES * n_fft), np.float32)
    turn, twiddles = np.empty((2, n_fft), np.float32), np.empty((2, n_fft), np.float32)
    _circle(-frequency, gain, turn)
    _circle(-1 / n_fft, 1.0, twiddles)
    begin, places = np.empty((2, N_LANES), np.float32), np.empty(N_LANES, np.int64)
    square = np.empty(N_LANES * N_LANES, np.float32)
    offset_re, offset_im = splat(dc.real), splat(dc.imag)
    re, im, to_re, to_im = parts[0], parts[1], parts[2], parts[3]
    n = starts.size
    for row in range(0, n, N_LANES):
        for lane in range(N_LANES):
            place = starts[min(row + lane, n - 1)]
            phase = -2 * math.pi * frequency * (place + origin)
            begin[0, lane], begin[1, lane] = math.cos(phase), math.sin(phase)
            places[lane] = 2 * place
        begin_re, begin_im = load(begin, 0), load(begin, N_LANES)
        for m in range(0, n_fft, N_LANES // 2):
            for lane in range(N_LANES):
                store(square, N_LANES * lane, load(flat, places[lane] + 2 * m))
            _transpose(square)
            for i in range(N_LANES // 2):
                a = load(square, 2 * N_LANES * i) - offset_re
                b = load(square, 2 * N_LANES * i + N_LANES) - offset_im
                c, s = splat(turn[0, m + i]), splat(turn[1, m + i])
                by_re, by_im = c * begin_re - s * begin_im, c * begin_im + s * begin_re
                store(re, N_LANES * (m + i), a * by_re - b * by_im)
                store(im, N_LANES * (m + i), a * by_im + b * by_re)
        swapped = _transform(re, im, to_re, to_im, n_fft, twiddles)
        if swapped:
            _sort(to_re, to_im, bins, out[row:], square)
        else:
            _sort(re, im, bins, out[row:], square)


@njit(nogil=True, cache=True)
def _circle(frequency: float, size: float, out: NDArray[np.float32]) -> None:
    """size · exp(j 2π · frequency · m)."""
    step = complex(math.cos(2 * math.pi * frequency), math.sin(2 * math.pi * frequency))
    value = complex(size)
    for m in range(out.shape[1]):
        out[0, m], out[1, m] = value.real, value.imag
        value *= step


@njit(nogil=True, forceinline=True)
def _transpose(square: Row) -> None:
    """Eight rows of eight: rows become columns, as cards are shuffled three times."""
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


@njit(nogil=True, cache=True)
def _sort(re: Row, im: Row, bins: NDArray[np.int64], out: NDArray[np.float32], square: Row) -> None:
    """Lanes to rows of `out` `[≤ 8 …, 2, width]`, bins to the order of `bins`."""
    n_rows, width = min(N_LANES, out.shape[0]), out.shape[2]
    for part in range(2):
        of = im if part else re
        for first in range(0, width, N_LANES):
            for i in range(N_LANES):
                inside = first + i < bins.size
                value = load(of, N_LANES * bins[first + i]) if inside else splat(0.0)
                store(square, N_LANES * i, value)
            _transpose(square)
            for lane in range(n_rows):
                store(out, (2 * lane + part) * width + first, load(square, N_LANES * lane))


@njit(nogil=True, cache=True)
def _transform(
    re: Row, im: Row, to_re: Row, to_im: Row, n: int, twiddles: NDArray[np.float32]
) -> bool:
    """The FFT of lanes `[n · 8]`; True when it is in `to_re`, `to_im`, else in `re`, `im`."""
    left, stride, swapped = n, 1, False
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


@njit(nogil=True, cache=True)
def _radix_4(
    re: Row, im: Row, to_re: Row, to_im: Row, n: int, stride: int, twiddles: NDArray[np.float32]
) -> None:
    """A stage: `n` groups of `stride` butterflies."""
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


@njit(nogil=True, cache=True)
def _radix_2(re: Row, im: Row, to_re: Row, to_im: Row, stride: int) -> None:
    """The last stage of sizes that are no power of 4."""
    half = N_LANES * stride
    for a in range(0, half, N_LANES):
        b = a + half
        store(to_re, a, load(re, a) + load(re, b))
        store(to_im, a, load(im, a) + load(im, b))
        store(to_re, b, load(re, a) - load(re, b))
        store(to_im, b, load(im, a) - load(im, b))
