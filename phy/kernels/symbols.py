"""Coded bits to carriers, and symbols to samples with their prefix."""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(nogil=True, cache=True)
def map_bits(
    coded: NDArray[np.uint8],
    order: NDArray[np.int32],
    points: NDArray[np.complex64],
    data_bins: NDArray[np.int64],
    pilot_bins: NDArray[np.int64],
    pilots: NDArray[np.float32],
    polarity: NDArray[np.float32],
    out: NDArray[np.complex64],
) -> None:
    """Interleave coded bits and put them and the pilots on the bins of symbols `[n, n_fft]`."""
    bits = order.size // data_bins.size
    carrier_bits = np.empty(order.size, np.uint8)
    for row in range(out.shape[0]):
        for k in range(order.size):
            carrier_bits[order[k]] = coded[row * order.size + k]
        for d in range(data_bins.size):
            number = 0
            for b in range(bits):
                number = number << 1 | carrier_bits[d * bits + b]
            out[row, data_bins[d]] = points[number]
        for p in range(pilot_bins.size):
            out[row, pilot_bins[p]] = pilots[p] * polarity[row]


@njit(nogil=True, cache=True)
def with_prefix(
    body: NDArray[np.complex64], scale: float, most: float, out: NDArray[np.complex64]
) -> None:
    """Symbols `[n, n_fft]` times `scale` with their last samples before them `[n, n_symbol]`.

    Samples beyond the magnitude `most` are shortened to it.
    """
    n_fft, n_cp = body.shape[1], out.shape[1] - body.shape[1]
    scale_32 = np.float32(scale)
    square, most_32 = np.float32(most * most), np.float32(most)
    for row in range(body.shape[0]):
        symbol = out[row, n_cp:]
        for m in range(n_fft):
            symbol[m] = body[row, m] * scale_32
        for m in range(n_fft):
            power = symbol[m].real * symbol[m].real + symbol[m].imag * symbol[m].imag
            if power > square:
                symbol[m] *= most_32 / np.sqrt(power)
        for m in range(n_cp):
            out[row, m] = out[row, n_fft + m]
