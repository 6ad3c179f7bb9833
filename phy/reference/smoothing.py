"""Smoothing: removes probable noise from the channel estimate, and later follows the channel.

A channel has few echoes. Rotated back by its mean delay, its gains are smooth over the subcarriers,
so that most of their power is in few of the functions 1, cos k, sin k, cos 2k, … Noise is equally
in all of them.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from phy.numerology import Numerology
from phy.reference.channel import Channel
from phy.reference.ofdm import Subcarriers

GROUPS = ((0,), (1,), (2, 3), (4, 5, 6, 7, 8))
"""Delays of each group's echoes from the mean delay; one more group has all up to a prefix."""
DRIFT_RISE, DRIFT_FALL = 0.5, 0.1
"""Rates at which the drift estimate rises and falls with the observations."""


@cache
def basis(grid: Numerology) -> tuple[NDArray[np.float64], ...]:
    """The functions 1, cos k, sin k, cos 2k, … (2πk/64), orthonormal, in groups `[m, n_used]`."""
    angle = 2 * np.pi * grid.used / grid.n_fft
    outermost = tuple(range(GROUPS[-1][-1] + 1, grid.n_cp + 1))
    rows: list[NDArray[np.float64]] = []
    ends = []
    for group in filter(None, (*GROUPS, outermost)):
        for delay in group:
            rows.append(np.cos(delay * angle))
            if delay:
                rows.append(np.sin(delay * angle))
        ends.append(len(rows))
    orthonormal, _ = np.linalg.qr(np.array(rows).T)
    return tuple(np.split(orthonormal.T, ends[:-1]))


def sizes(grid: Numerology) -> NDArray[np.int64]:
    """Number of dimensions of each group, and last of the rest `[groups + 1]`."""
    own = [len(rows) for rows in basis(grid)]
    return np.array([*own, grid.n_used - sum(own)])


def mean_delay(h: Subcarriers, grid: Numerology) -> float:
    """Mean phase in radians from one subcarrier to the next: arg Σ_k Ĥ_{k+1} Ĥ*_k."""
    next_to = np.flatnonzero(np.diff(grid.used) == 1)
    return float(np.angle(np.sum(h[next_to + 1] * h[next_to].conj())))


def centred(h: Subcarriers, delay: float, grid: Numerology) -> Subcarriers:
    """Rotate gains `[n_used]` back by `delay` radians per subcarrier."""
    return np.asarray(h * np.exp(-1j * delay * grid.used))


def split(x: Subcarriers, wanted: NDArray[np.bool_], grid: Numerology) -> Subcarriers:
    """Split `x` `[n_used]` into the parts of each group `[groups + 1, n_used]`.

    The last part is everything outside the groups `wanted` `[groups + 1]`.
    """
    parts = np.zeros((len(wanted), grid.n_used), np.complex128)
    for group, rows in enumerate(basis(grid)):
        if wanted[group]:
            parts[group] = (rows @ x) @ rows
    parts[-1] = x - parts.sum(axis=0)
    return parts


def energies(parts: Subcarriers) -> NDArray[np.float64]:
    """Energy of each part: `[groups + 1, n_used]` becomes `[groups + 1]`."""
    return np.asarray(np.sum(np.abs(parts) ** 2, axis=1))


def smooth(h: Subcarriers, variance: float, channel: Channel, grid: Numerology) -> None:
    """Set the channel's gains to `h`, measured with noise of `variance`, less most of the noise.

        kept of a group = max(0, 1 − v (m + √m) / E)   (James and Stein 1961; 1 − v/E where m = 1)

    m is the group's size and E its energy. The remaining variance of a group is kept · v per
    dimension, its power kept · E/m.
    """
    channel.delay = mean_delay(h, grid)
    m = sizes(grid)
    parts = split(centred(h, channel.delay, grid), np.ones(len(m), bool), grid)
    e = energies(parts)
    expected = variance * (m + np.where(m > 1, np.sqrt(m), 0))
    kept = np.maximum(0, 1 - expected / np.maximum(e, 1e-300))
    channel.unknown = kept * variance
    channel.power = kept * e / m
    channel.h = centred(kept @ parts, -channel.delay, grid)


def follow(error: Subcarriers, variance: float, channel: Channel, grid: Numerology) -> None:
    """Move the channel towards later symbols, which deviate from it by `error` `[n_used]`.

        p' = p + drift · power;  weight = p' / (p' + v);  p = p' (1 − weight)

    This is a Kalman filter for each group, where p is the variance per dimension and v the
    `variance` of the error. The drift follows the excess of the errors over noise and uncertainty,
    beyond two standard deviations. Groups in which nothing was found count as noise, all together.
    """
    m, power = sizes(grid), channel.power
    parts = split(centred(error, channel.delay, grid), power > 0, grid)
    expected = variance + channel.unknown
    excess = np.sum(energies(parts) - m * expected)
    chance = np.sqrt(np.sum(m * expected**2))
    if np.sum(m * power) > 0:
        seen = max(0.0, float((excess - 2 * chance) / np.sum(m * power)))
        share = DRIFT_RISE if seen > channel.drift else DRIFT_FALL
        channel.drift += share * (seen - channel.drift)
    before = channel.unknown + channel.drift * power
    weight = before / (before + variance)
    channel.unknown = before * (1 - weight)
    channel.h = channel.h + centred(weight @ parts, -channel.delay, grid)
