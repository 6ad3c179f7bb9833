"""Known symbols against received ones, tone by tone."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.burst import DELAY, GAIN, NO, Channel, Planes, Tones
from phy.kernels.smoothing import mean_delay, smooth

# Standard deviations at which a difference in strength is no chance.
_SURELY = 4.0
_LARGEST_BOOST = 3.0


@njit(nogil=True, cache=True)
def turn_back(x: NDArray[np.complex64], dc: complex, frequency: float, out: Planes) -> None:
    """Samples `x` `[n]` less `dc`, turned back by `frequency` cycles a sample; `out` `[2, ≥ n]`."""
    span = 32
    fine_re, fine_im = np.empty(span, np.float32), np.empty(span, np.float32)
    step = -2 * math.pi * frequency
    for m in range(span):
        fine_re[m], fine_im[m] = math.cos(step * m), math.sin(step * m)
    dc_re, dc_im = np.float32(dc.real), np.float32(dc.imag)
    for begin in range(0, x.size, span):
        c, s = np.float32(math.cos(step * begin)), np.float32(math.sin(step * begin))
        for m in range(min(span, x.size - begin)):
            re = c * fine_re[m] - s * fine_im[m]
            im = c * fine_im[m] + s * fine_re[m]
            a, b = x[begin + m].real - dc_re, x[begin + m].imag - dc_im
            out[0, begin + m] = a * re - b * im
            out[1, begin + m] = a * im + b * re


# Sums in any order, so that they are vectorised; the order is the same at every call.
@njit(nogil=True, cache=True, fastmath={"reassoc", "contract"})
def wave(
    matrix: NDArray[np.complex64], h_hat: NDArray[np.complex64], out: NDArray[np.complex64]
) -> None:
    """matrix · h_hat, without BLAS: its threads cost more than so small a product."""
    for i in range(matrix.shape[0]):
        re, im = np.float32(0), np.float32(0)
        for j in range(matrix.shape[1]):
            a, b = matrix[i, j], h_hat[j]
            re += a.real * b.real - a.imag * b.imag
            im += a.real * b.imag + a.imag * b.real
        out[i] = complex(re, im)


@njit(nogil=True, cache=True)
def least_squares(
    y: NDArray[np.float32],
    amplitude: NDArray[np.float32],
    sent: NDArray[np.complex64],
    out: NDArray[np.complex64],
) -> tuple[float, float]:
    """Gain of each tone over `n` ≥ 2 symbols; (noise power on a tone, mean |h|²).

    `sent` `[n, n_used]` of magnitude 1 went out times `amplitude` `[n]`, and came as `y`
    `[n, 2, ≥ n_used]`.
    """
    n, n_used = sent.shape
    mass, noise, power = 0.0, 0.0, 0.0
    for s in range(n):
        mass += amplitude[s] * amplitude[s]
    for k in range(n_used):
        total, square = 0j, 0.0
        for s in range(n):
            gain = complex(y[s, 0, k], y[s, 1, k]) * complex(sent[s, k]).conjugate()
            total += gain * amplitude[s]
            square += gain.real * gain.real + gain.imag * gain.imag
        h = total / mass
        size = h.real * h.real + h.imag * h.imag
        noise += square - mass * size
        power += size
        out[k] = np.complex64(h)
    return noise / ((n - 1) * n_used), power / n_used


@njit(nogil=True, cache=True)
def estimate(
    y: NDArray[np.float32],
    amplitude: NDArray[np.float32],
    sent: NDArray[np.complex64],
    tones: Tones,
    channel: Channel,
) -> None:
    """The channel from known symbols, as of `least_squares`, less what must be noise."""
    rough = np.empty(tones.bins.size, np.complex64)
    no, power = least_squares(y, amplitude, sent, rough)
    mass = 0.0
    for a in amplitude:
        mass += a * a
    no = max(no, 1e-20)
    delay = mean_delay(rough, tones.neighbours)
    channel.figures[NO] = no
    channel.figures[GAIN] = max(power - no / mass, 1e-3 * power, 1e-20)
    channel.figures[DELAY] = delay
    smooth(
        rough, no / mass, delay, tones.carriers, tones.basis, tones.ends,
        channel.unknown, channel.power, channel.h_hat,
    )  # fmt: skip


@njit(nogil=True, cache=True)
def learn(
    y: NDArray[np.float32],
    sent: NDArray[np.complex64],
    n_training: int,
    phase: float,
    rate: float,
    tones: Tones,
    channel: Channel,
) -> None:
    """The channel anew with the header, now known, as further training; `y` is used up.

    `phase` is the last symbol's, `rate` how it grows a symbol. The preamble may have been sent
    stronger than the rest: if so is what the header tells.
    """
    n, n_used = sent.shape
    seen, expected = 0.0, 0.0
    for s in range(n_training, n):
        angle = phase - (n - 1 - s) * rate
        back = np.complex64(complex(math.cos(angle), -math.sin(angle)))
        for k in range(n_used):
            turned = np.complex64(complex(y[s, 0, k], y[s, 1, k])) * back
            y[s, 0, k], y[s, 1, k] = turned.real, turned.imag
            h = channel.h_hat[k]
            product = turned * np.conj(sent[s, k]) * np.conj(h)
            seen += product.real
            expected += h.real * h.real + h.imag * h.imag
    amplitude = np.ones(n, np.float32)
    if seen > 0.0:
        ratio = expected / seen
        if abs(1 / ratio - 1) > _SURELY * math.sqrt(0.5 * channel.figures[NO] / expected):
            for s in range(n_training):
                amplitude[s] = min(max(ratio, 1 / _LARGEST_BOOST), _LARGEST_BOOST)
    estimate(y, amplitude, sent, tones, channel)
