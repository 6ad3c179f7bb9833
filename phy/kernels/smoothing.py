"""Removes from a channel estimate the part that must be noise.

A channel has few echoes, so its gains are smooth over the subcarriers. Centred on their mean delay,
most of their power is in few of the functions 1, cos k, sin k, cos 2k, … (k: subcarriers over
n_fft), made orthonormal. The functions form groups, from the mean delay outwards; everything
outside them is the last group.

Each group is kept in proportion to its energy in excess of pure noise (James and Stein 1961). On a
line-of-sight link that is one dimension of 52, among many echoes almost all; no prior knowledge of
the channel is needed.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, load, splat, store, total
from phy.kernels.rotation import lean
from phy.sizes import N_LANES
from phy.tables.burst import DELAY, DRIFT, Channel, Planes, Scratch, Tones

# Rates at which the drift estimate of a channel follows the observations.
_DRIFT_RISE, _DRIFT_FALL = 0.5, 0.1


@njit(nogil=True, cache=True)
def mean_delay(h: Planes, neighbors: NDArray[np.int64]) -> float:
    """Mean phase in radians between adjacent subcarriers, over the pairs `neighbors` `[2, n]`."""
    turn = 0j
    for i in range(neighbors.shape[1]):
        first, second = neighbors[0, i], neighbors[1, i]
        turn += complex(h[0, second], h[1, second]) * complex(h[0, first], -h[1, first])
    return math.atan2(turn.imag, turn.real)


@step
def multiply(x: Planes, by: Planes, conjugate: bool, out: Planes) -> None:
    """Write x · by, or x · by* if `conjugate`, to `out`, over whole rows."""
    width, sign = x.shape[1], splat(-1.0 if conjugate else 1.0)
    for k in range(0, width, N_LANES):
        a, b = load(x, k), load(x, width + k)
        c, d = load(by, k), load(by, width + k) * sign
        store(out, k, a * c - b * d)
        store(out, width + k, a * d + b * c)


@step
def _split(tones: Tones, wanted: NDArray[np.float64], scratch: Scratch) -> None:
    """Split `rest` into the `wanted` groups: coefficients of their rows, energies of all groups.

    Everything outside these groups counts as the last group.
    """
    rest, basis, coefficients = scratch.rest, tones.basis, scratch.coefficients
    energies, width = scratch.energies, scratch.rest.shape[1]
    power: Lanes = splat(0)
    for k in range(0, width, N_LANES):
        a, b = load(rest, k), load(rest, width + k)
        power = power + (a * a + b * b)
    left, first = float(total(power)), 0
    for group in range(tones.ends.size):
        last = tones.ends[group]
        energy = 0.0
        if wanted[group] > 0:
            for d in range(first, last):
                re: Lanes = splat(0)
                im: Lanes = splat(0)
                for k in range(0, width, N_LANES):
                    along = load(basis, d * width + k)
                    re = re + along * load(rest, k)
                    im = im + along * load(rest, width + k)
                a, b = total(re), total(im)
                coefficients[0, d], coefficients[1, d] = a, b
                energy += float(a * a + b * b)
        energies[group] = energy
        left -= energy
        first = last
    energies[tones.ends.size] = max(left, 0.0)


@step
def _join(tones: Tones, scratch: Scratch) -> None:
    """Reassemble `rest`, each group times its weight."""
    rest, basis, coefficients = scratch.rest, tones.basis, scratch.coefficients
    weights, width = scratch.weights, scratch.rest.shape[1]
    usual, first = weights[tones.ends.size], 0
    for k in range(0, 2 * width, N_LANES):
        # The last group has no rows: apply its weight to all of `rest`, then correct the other
        # groups.
        store(rest, k, load(rest, k) * splat(usual))
    for group in range(tones.ends.size):
        more = np.float32(weights[group] - usual)
        if scratch.energies[group] > 0 and more != 0:
            for d in range(first, tones.ends[group]):
                re, im = splat(more * coefficients[0, d]), splat(more * coefficients[1, d])
                for k in range(0, width, N_LANES):
                    along = load(basis, d * width + k)
                    store(rest, k, load(rest, k) + along * re)
                    store(rest, width + k, load(rest, width + k) + along * im)
        first = tones.ends[group]


@step
def _size(group: int, tones: Tones) -> int:
    """Number of dimensions of a group."""
    first = tones.ends[group - 1] if group else 0
    return (tones.ends[group] if group < tones.ends.size else tones.bins.size) - first


@step
def _kept(energy: float, size: int, variance: float) -> float:
    """Share of a group of `size` dimensions that is not noise; a cautious estimate."""
    expected = size * variance
    if size > 1:
        expected += math.sqrt(size) * variance
    return max(0.0, 1 - expected / energy) if energy > 0 else 0.0


@njit(nogil=True, cache=True)
def smooth(variance: float, tones: Tones, channel: Channel, scratch: Scratch) -> None:
    """Remove most of the noise from the gains `h`, which were measured with noise of `variance`.

    For each group, `unknown` gets the remaining variance per dimension, `power` the mean power per
    dimension.
    """
    channel.figures[DELAY] = mean_delay(channel.h, tones.neighbors)
    lean(-channel.figures[DELAY], tones.subcarriers, channel.centre)
    multiply(channel.h, channel.centre, False, scratch.rest)
    channel.power[:] = 1
    _split(tones, channel.power, scratch)
    for group in range(channel.power.size):
        size, energy = _size(group, tones), scratch.energies[group]
        weight = _kept(energy, size, variance)
        scratch.weights[group] = weight
        channel.unknown[group] = weight * variance
        channel.power[group] = weight * energy / size
    _join(tones, scratch)
    multiply(scratch.rest, channel.centre, True, channel.h)


@njit(nogil=True, cache=True, error_model="numpy")
def follow(
    error: Planes, variance: float, tones: Tones, channel: Channel, scratch: Scratch
) -> None:
    """Correct the gains by `error` `[2, width]`, the deviation of later symbols.

    `error` is overwritten. Each group has a Kalman filter; `unknown` is the variance of its
    estimate. The channel moves by the drift times its `power`; the drift follows the excess of the
    errors over noise and uncertainty.
    """
    power, unknown, energies = channel.power, channel.unknown, scratch.energies
    multiply(error, channel.centre, False, scratch.rest)
    # Groups in which nothing was found count as noise, all together.
    _split(tones, power, scratch)
    excess, chance, whole = 0.0, 0.0, 0.0
    for group in range(power.size):
        size = _size(group, tones)
        expected = variance + unknown[group]
        excess += energies[group] - size * expected
        chance += size * expected * expected
        whole += size * power[group]
    drift = channel.figures[DRIFT]
    if whole > 0:
        # Two standard deviations count as chance, so that a still channel is recognised as still.
        seen = max(0.0, (excess - 2 * math.sqrt(chance)) / whole)
        drift += (_DRIFT_RISE if seen > drift else _DRIFT_FALL) * (seen - drift)
        channel.figures[DRIFT] = drift
    for group in range(power.size):
        before = unknown[group] + drift * power[group]
        weight = before / (before + variance)
        scratch.weights[group] = weight
        unknown[group] = before * (1 - weight)
    _join(tones, scratch)
    multiply(scratch.rest, channel.centre, True, error)
    add(channel.h, error)


@step
def add(x: Planes, more: Planes) -> None:
    """Add `more` to `x`, in place."""
    for k in range(0, x.size, N_LANES):
        store(x, k, load(x, k) + load(more, k))
