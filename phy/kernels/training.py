"""Estimates the channel from known symbols, tone by tone."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.fft import circle
from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, load, splat, store, total
from phy.kernels.local import local
from phy.kernels.smoothing import mean_delay, smooth, start
from phy.sizes import N_LANES
from phy.tables.burst import GAIN, NO, SCALED, Channel, Planes, Row, Scratch, Tones

# Number of standard deviations from which a difference in strength is not chance.
_SURELY = 4.0
_LARGEST_BOOST = 3.0
# Steps in which the gains of subcarriers that were cut are found.
_FILLS = 8
# They begin with the mean of the gains that are at most so much farther than the nearest.
_NEXT = 4


@njit(nogil=True, cache=True, error_model="numpy")
def turn_back(x: NDArray[np.complex64], dc: complex, frequency: float, out: Planes) -> None:
    """Write `x` `[n]` minus `dc`, rotated by −`frequency` cycles a sample, to `out` `[2, …]`."""
    span, n = 32, x.size
    fine, coarse = local(np.float32, (2, span)), local(np.float32, (2, -(-n // span)))
    circle(-frequency, 1.0, fine)
    circle(-frequency * span, 1.0, coarse)
    dc_re, dc_im = np.float32(dc.real), np.float32(dc.imag)
    for block in range(coarse.shape[1]):
        begin, c, s = block * span, coarse[0, block], coarse[1, block]
        for m in range(min(span, n - begin)):
            re = c * fine[0, m] - s * fine[1, m]
            im = c * fine[1, m] + s * fine[0, m]
            a, b = x[begin + m].real - dc_re, x[begin + m].imag - dc_im
            out[0, begin + m] = a * re - b * im
            out[1, begin + m] = a * im + b * re


@njit(nogil=True, cache=True, error_model="numpy")
def least_squares(
    y: NDArray[np.float32], amplitude: Row, sent: NDArray[np.float32], h: Planes
) -> tuple[float, float]:
    """Write each tone's gain over `n` ≥ 2 symbols to `h` `[2, width]`; returns (Σ noise, Σ |h|²).

    `sent` `[n, 2, width]` holds 1 / x* of tones x, which were sent times `amplitude` `[n]` and
    received as `y`. Both sums are over the tones. A symbol with the amplitude 0, and 0 as `y`, does
    not count.
    """
    n, width, n_heard = sent.shape[0], sent.shape[2], 0
    mass = np.float32(0)
    for s in range(n):
        mass += amplitude[s] * amplitude[s]
        n_heard += amplitude[s] > 0
    share = splat(1 / mass)
    noise: Lanes = splat(0)
    power: Lanes = splat(0)
    for k in range(0, width, N_LANES):
        re: Lanes = splat(0)
        im: Lanes = splat(0)
        for s in range(n):
            a, b, c, d = _pair(y, sent, s, k)
            strength = splat(amplitude[s])
            re = re + (a * c + b * d) * strength
            im = im + (b * c - a * d) * strength
        re, im = re * share, im * share
        store(h, k, re)
        store(h, width + k, im)
        power = power + (re * re + im * im)
        for s in range(n):
            a, b, c, d = _pair(y, sent, s, k)
            strength = splat(amplitude[s])
            re_off = a * c + b * d - re * strength
            im_off = b * c - a * d - im * strength
            noise = noise + (re_off * re_off + im_off * im_off)
    return float(total(noise)) / (n_heard - 1), float(total(power))


@step
def _pair(
    y: NDArray[np.float32], sent: NDArray[np.float32], s: int, k: int
) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Eight tones from `k` on of symbol `s`, as received and as sent."""
    width = sent.shape[2]
    at = 2 * width * s + k
    return load(y, at), load(y, at + width), load(sent, at), load(sent, at + width)


@njit(nogil=True, cache=True, error_model="numpy")
def estimate(
    y: NDArray[np.float32],
    amplitude: Row,
    sent: NDArray[np.float32],
    tones: Tones,
    channel: Channel,
    scratch: Scratch,
) -> None:
    """Estimate the channel from known symbols by `least_squares`, without the probable noise."""
    n_cut = _leave_out(y, sent.shape[0], tones, channel)
    n_used = tones.bins.size - n_cut
    noise, power = least_squares(y, amplitude, sent, channel.h)
    no, power = max(noise / n_used, 1e-20), power / n_used
    mass = 0.0
    for a in amplitude:
        mass += a * a
    channel.figures[NO] = no
    # Measured gains include noise. If they contain nothing else, the difference may be negative.
    channel.figures[GAIN] = max(power - no / mass, 1e-3 * power, 1e-20)
    if n_cut:
        _fill(no / mass, tones, channel, scratch)
    smooth(no / mass, tones, channel, scratch)
    start(tones, channel)


@step
def _leave_out(y: NDArray[np.float32], n: int, tones: Tones, channel: Channel) -> int:
    """Set tones of the `n` known symbols to 0 that were cut; returns their number."""
    n_cut = 0
    for k in range(tones.bins.size):
        if channel.kept[0, k] == 0:
            n_cut += 1
            for s in range(n):
                y[s, 0, k] = y[s, 1, k] = 0
    return n_cut


@step
def _fill(variance: float, tones: Tones, channel: Channel, scratch: Scratch) -> None:
    """Give the tones that were cut the gains that the smoother expects from all others.

    They begin with the gains next to them, with the mean delay. Each step of expectation
    maximisation puts what was expected in their place.
    """
    delay = mean_delay(channel.h, tones.neighbors)
    for k in range(tones.bins.size):
        if channel.kept[0, k] == 0:
            near = tones.n_fft
            for i in range(tones.bins.size):
                if channel.kept[0, i] != 0:
                    near = min(near, abs(tones.subcarriers[i] - tones.subcarriers[k]))
            mean, n = 0j, 0
            for i in range(tones.bins.size):
                apart = tones.subcarriers[k] - tones.subcarriers[i]
                if channel.kept[0, i] != 0 and abs(apart) < near + _NEXT:
                    turn = complex(math.cos(delay * apart), math.sin(delay * apart))
                    mean += complex(channel.h[0, i], channel.h[1, i]) * turn
                    n += 1
            if n:
                channel.h[0, k], channel.h[1, k] = mean.real / n, mean.imag / n
    measured = local(np.float32, channel.h.shape)
    for k in range(measured.shape[1]):
        measured[0, k], measured[1, k] = channel.h[0, k], channel.h[1, k]
    for _ in range(_FILLS):
        smooth(variance, tones, channel, scratch)
        for k in range(tones.bins.size):
            if channel.kept[0, k] != 0:
                channel.h[0, k], channel.h[1, k] = measured[0, k], measured[1, k]


@njit(nogil=True, cache=True, error_model="numpy")
def learn(
    y: NDArray[np.float32],
    sent: NDArray[np.float32],
    n_training: int,
    phase: float,
    rate: float,
    tones: Tones,
    channel: Channel,
    scratch: Scratch,
) -> None:
    """Estimate the channel again, with the decoded header as further training; overwrites `y`.

    `phase` is the last symbol's, `rate` its growth per symbol. The preamble may have been sent
    stronger than the rest: the header shows whether, and by how much. Symbols of which samples
    were blanked are left out, unless fewer than two others are left.
    """
    n, width, n_whole, n_lost = sent.shape[0], sent.shape[2], 0, 0
    for s in range(n):
        n_whole += channel.whole[s] == 1
        n_lost += s < n_training and channel.whole[s] < 1
    seen: Lanes = splat(0)
    expected: Lanes = splat(0)
    for s in range(n_training, n):
        angle = phase - (n - 1 - s) * rate
        cos, sin = splat(math.cos(angle)), splat(math.sin(angle))
        for k in range(0, width, N_LANES):
            a, b, c, d = _pair(y, sent, s, k)
            a, b = a * cos + b * sin, b * cos - a * sin
            at = 2 * width * s + k
            store(y, at, a)
            store(y, at + width, b)
            if channel.whole[s] < 1:
                continue
            keep = load(channel.kept[0], k)
            h_re, h_im = load(channel.h, k) * keep, load(channel.h, width + k) * keep
            seen = seen + (a * (h_re * c - h_im * d) + b * (h_re * d + h_im * c))
            expected = expected + (h_re * h_re + h_im * h_im)
    amplitude = local(np.float32, n)
    amplitude[:] = 1
    match, power = float(total(seen)), float(total(expected))
    # What is missing in the training would look like a weaker one.
    if match > 0.0 and not n_lost:
        # The gains may have been scaled to the header.
        ratio = power / match / channel.figures[SCALED]
        if abs(1 / ratio - 1) > _SURELY * math.sqrt(0.5 * channel.figures[NO] / power):
            for s in range(n_training):
                amplitude[s] = min(max(ratio, 1 / _LARGEST_BOOST), _LARGEST_BOOST)
    if n_whole >= 2:
        for s in range(n):
            if channel.whole[s] < 1:
                amplitude[s] = 0
                for k in range(width):
                    y[s, 0, k] = y[s, 1, k] = 0
    estimate(y, amplitude, sent, tones, channel, scratch)
