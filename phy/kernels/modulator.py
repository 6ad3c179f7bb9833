"""Converts PDUs to samples, eight OFDM symbols at a time."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.fft import transform, transpose
from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, least, load, root, splat, store
from phy.kernels.ldpc_encoder import encode_octets
from phy.kernels.local import local
from phy.kernels.openers import open_form, open_map, open_tones
from phy.sizes import N_LANES
from phy.tables.block import PackedArguments
from phy.tables.burst import Row, Tones
from phy.tables.mapping import Map

_ROUNDS = 2
"""After so many, a symbol's amplitude is right to within half a per cent."""


@step
def map_symbol(
    coded: NDArray[np.uint8],
    at: int,
    polarity: float,
    tones: Tones,
    by: Map,
    y: NDArray[np.float32],
) -> None:
    """Write the tones `y` `[2, width]` of the symbol whose coded bits begin at `coded[at]`."""
    for d in range(tones.n_data):
        number = 0
        for b in range(by.bits):
            number = number << 1 | coded[at + by.source[d * by.bits + b]]
        y[0, d], y[1, d] = by.real[number], by.imag[number]
    for p in range(tones.pilots.size):
        y[0, tones.n_data + p], y[1, tones.n_data + p] = tones.pilots[p] * polarity, 0
    for k in range(tones.bins.size, y.shape[1]):
        y[0, k] = y[1, k] = 0


@step
def _kept(re: Row, im: Row, limit: Lanes) -> Lanes:
    """What clipping to `limit` leaves of the amplitude of each of eight symbols, as a factor."""
    power: Lanes = splat(0)
    left: Lanes = splat(0)
    for at in range(0, re.size, N_LANES):
        a, b = load(re, at), load(im, at)
        square = a * a + b * b
        power = power + square
        left = left + least(limit * root(square), square)
    return left / power


@njit(nogil=True, cache=True, error_model="numpy")
def eight_symbols(
    y: NDArray[np.float32],
    n: int,
    peak: float,
    tones: Tones,
    windows: NDArray[np.float32],
    square: Row,
    out: NDArray[np.complex64],
) -> None:
    """Write `n` ≤ 8 symbols of tones `y` `[8, 2, width]` as samples `[n · n_symbol]`, mean power 1.

    No magnitude exceeds `peak`: what does is clipped, and what that takes of a symbol's amplitude
    is given back to the whole symbol. `windows` `[4, 8 n_fft]` and `square` `[64]` are working
    memory.
    """
    n_fft, n_symbol, width = tones.n_fft, tones.n_symbol, y.shape[2]
    n_cp, flat = n_symbol - n_fft, out.view(np.float32)
    re, im, to_re, to_im = windows[0], windows[1], windows[2], windows[3]
    re[:] = 0
    im[:] = 0
    for part in range(2):
        to = im if part else re
        for first in range(0, width, N_LANES):
            for lane in range(N_LANES):
                at = (2 * min(lane, n - 1) + part) * width + first
                store(square, N_LANES * lane, load(y, at))
            transpose(square)
            for i in range(min(N_LANES, tones.bins.size - first)):
                store(to, N_LANES * tones.bins[first + i], load(square, N_LANES * i))
    # Inverse FFT by the forward one: swap real and imaginary parts before and after.
    if transform(im, re, to_im, to_re, n_fft, tones.twiddles):
        re, im = to_re, to_im
    scale = 1 / (tones.gain * n_fft)
    limit, factor, one = splat(peak / scale), splat(scale), splat(1)
    for _ in range(_ROUNDS):
        kept = _kept(re, im, limit)
        limit, factor = splat(peak / scale) * kept, splat(scale) / kept
    for m in range(0, n_fft, N_LANES // 2):
        for i in range(N_LANES // 2):
            at = N_LANES * (m + i)
            a, b = load(re, at), load(im, at)
            share = least(limit / root(a * a + b * b), one) * factor
            store(square, 2 * N_LANES * i, a * share)
            store(square, 2 * N_LANES * i + N_LANES, b * share)
        transpose(square)
        for lane in range(n):
            store(flat, 2 * (lane * n_symbol + n_cp + m), load(square, N_LANES * lane))
    for lane in range(n):
        first = lane * n_symbol
        for m in range(first, first + n_cp):
            out[m] = out[m + n_fft]


@njit(nogil=True, cache=True, error_model="numpy")
def modulate(
    octets: NDArray[np.uint8],
    n_blocks: int,
    padding: NDArray[np.uint8],
    number: int,
    peak: float,
    form_in: PackedArguments,
    tones_in: PackedArguments,
    map_in: PackedArguments,
    coded: NDArray[np.uint8],
    out: NDArray[np.complex64],
) -> None:
    """Write whitened blocks of bytes as samples of whole symbols; the first symbol is `number`.

    `coded` is room for all coded bits; `padding` fills the rest of the last symbol.
    """
    form = open_form(form_in)
    n_coded = n_blocks * form.ends[-1]
    encode_octets(octets, n_blocks, form, coded)
    for i in range(coded.size - n_coded):
        coded[n_coded + i] = padding[i]
    modulate_bits(coded, number, peak, tones_in, map_in, out)


@njit(nogil=True, cache=True, error_model="numpy")
def modulate_bits(
    coded: NDArray[np.uint8],
    number: int,
    peak: float,
    tones_in: PackedArguments,
    map_in: PackedArguments,
    out: NDArray[np.complex64],
) -> None:
    """Write coded bits that fill whole symbols as samples; the first symbol is `number`."""
    tones, by = open_tones(tones_in), open_map(map_in)
    n_bits, n_symbol = tones.n_data * by.bits, tones.n_symbol
    windows = local(np.float32, (4, N_LANES * tones.n_fft))
    square = local(np.float32, N_LANES * N_LANES)
    y = local(np.float32, (N_LANES, 2, -(-tones.bins.size // N_LANES) * N_LANES))
    for first in range(0, coded.size // n_bits, N_LANES):
        n = min(N_LANES, coded.size // n_bits - first)
        for i in range(n):
            polarity = tones.polarity[number + first + i]
            map_symbol(coded, (first + i) * n_bits, polarity, tones, by, y[i])
        end = (first + n) * n_symbol
        eight_symbols(y, n, peak, tones, windows, square, out[first * n_symbol : end])
