"""What training tells of the channel, less what must be noise.

A channel is a few echoes, its gains over the carriers are smooth: centred on their mean delay, most
of their power is in few of the functions 1, cos k, sin k, cos 2k, … (k: carriers over n_fft), made
orthonormal. They come in groups, from the mean delay outwards; what is in none is the last group.

Of each group as much is kept as its energy exceeds what noise alone would have (James and Stein
1961): on a link in sight that is one dimension of 52, among many echoes almost all, and nobody
must know before which it will be.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.rotation import lean

# How fast the guess of a channel's drift follows what is seen of it.
_DRIFT_RISE, _DRIFT_FALL = 0.5, 0.1


@njit(nogil=True, cache=True)
def mean_delay(h: NDArray[np.complex64], neighbours: NDArray[np.int64]) -> float:
    """Phase from a carrier to the next, radians; `neighbours` `[2, n]` are positions in `h`."""
    total = 0j
    for i in range(neighbours.shape[1]):
        total += complex(h[neighbours[1, i]]) * complex(h[neighbours[0, i]]).conjugate()
    return math.atan2(total.imag, total.real)


# Sums in any order, so that they are vectorised; the order is the same at every call.
@njit(nogil=True, cache=True, fastmath={"reassoc", "contract"})
def _take(
    re: NDArray[np.float32],
    im: NDArray[np.float32],
    rows: NDArray[np.float32],
    c_re: NDArray[np.float32],
    c_im: NDArray[np.float32],
) -> float:
    """Move what is along `rows` from `re`, `im` to coefficients; its energy."""
    energy = np.float32(0)
    for d in range(rows.shape[0]):
        a, b = np.float32(0), np.float32(0)
        for k in range(re.size):
            a += rows[d, k] * re[k]
            b += rows[d, k] * im[k]
        c_re[d], c_im[d] = a, b
        energy += a * a + b * b
    for d in range(rows.shape[0]):
        _give(re, im, rows[d], -c_re[d], -c_im[d])
    return float(energy)


@njit(nogil=True, cache=True)
def _give(
    re: NDArray[np.float32],
    im: NDArray[np.float32],
    row: NDArray[np.float32],
    a: np.float32,
    b: np.float32,
) -> None:
    for k in range(re.size):
        re[k] += a * row[k]
        im[k] += b * row[k]


@njit(nogil=True, cache=True)
def _kept(energy: float, size: int, variance: float) -> float:
    """Share of a group of `size` dimensions that is no noise, erring towards noise."""
    expected = size * variance
    if size > 1:
        expected += math.sqrt(size) * variance
    return max(0.0, 1 - expected / energy) if energy > 0 else 0.0


@njit(nogil=True, cache=True)
def _centre(
    h: NDArray[np.complex64],
    turn: NDArray[np.complex64],
    basis: NDArray[np.float32],
    ends: NDArray[np.int64],
    wanted: NDArray[np.bool_],
    planes: NDArray[np.float32],
    coefficients: NDArray[np.float32],
    energies: NDArray[np.float64],
) -> None:
    """`h` turned by `turn`, as `coefficients` of the basis and, in `planes`, what is left.

    Of the groups that are `wanted`; `energies` `[groups + 1]` of each.
    """
    n = h.size
    re, im = planes[0], planes[1]
    for k in range(n):
        centred = h[k] * turn[k]
        re[k], im[k] = centred.real, centred.imag
    first = 0
    for group in range(ends.size):
        last = ends[group]
        if wanted[group]:
            c_re, c_im = coefficients[0, first:last], coefficients[1, first:last]
            energies[group] = _take(re, im, basis[first:last], c_re, c_im)
        else:
            energies[group] = 0.0
        first = last
    rest = np.float32(0)
    for k in range(n):
        rest += re[k] * re[k] + im[k] * im[k]
    energies[ends.size] = rest


@njit(nogil=True, cache=True)
def _weigh(
    weights: NDArray[np.float64],
    turn: NDArray[np.complex64],
    basis: NDArray[np.float32],
    ends: NDArray[np.int64],
    planes: NDArray[np.float32],
    coefficients: NDArray[np.float32],
    out: NDArray[np.complex64],
) -> None:
    """The way back, each group times its weight."""
    re, im = planes[0], planes[1]
    share = np.float32(weights[ends.size])
    for k in range(re.size):
        re[k] *= share
        im[k] *= share
    first = 0
    for group in range(ends.size):
        share = np.float32(weights[group])
        if share != 0:
            for d in range(first, ends[group]):
                _give(re, im, basis[d], share * coefficients[0, d], share * coefficients[1, d])
        first = ends[group]
    for k in range(re.size):
        out[k] = complex(re[k], im[k]) * np.conj(turn[k])


@njit(nogil=True, cache=True)
def _size(group: int, ends: NDArray[np.int64], n: int) -> int:
    """Dimensions of a group."""
    first = ends[group - 1] if group else 0
    return (ends[group] if group < ends.size else n) - first


@njit(nogil=True, cache=True)
def smooth(
    h: NDArray[np.complex64],
    variance: float,
    delay: float,
    carriers: NDArray[np.int64],
    basis: NDArray[np.float32],
    ends: NDArray[np.int64],
    unknown: NDArray[np.float64],
    power: NDArray[np.float64],
    out: NDArray[np.complex64],
) -> None:
    """The gains `h` `[n_used]`, measured with noise of `variance`, without most of that noise.

    `delay` as of `mean_delay`; rows of `basis` `[n, n_used]` are a group up to each of `ends`.
    `unknown` `[groups + 1]` gets the variance a dimension that is left, `power` what is in it.
    """
    n = h.size
    turn, planes = np.empty(n, np.complex64), np.empty((2, n), np.float32)
    coefficients = np.empty((2, basis.shape[0]), np.float32)
    lean(-delay, carriers, turn)
    wanted = np.ones(ends.size, np.bool_)
    _centre(h, turn, basis, ends, wanted, planes, coefficients, power)
    weights = np.empty(power.size)
    for group in range(power.size):
        size = _size(group, ends, n)
        weights[group] = _kept(power[group], size, variance)
        unknown[group] = weights[group] * variance
        power[group] *= weights[group] / size
    _weigh(weights, turn, basis, ends, planes, coefficients, out)


@njit(nogil=True, cache=True)
def follow(
    error: NDArray[np.complex64],
    variance: float,
    delay: float,
    drift: float,
    carriers: NDArray[np.int64],
    basis: NDArray[np.float32],
    ends: NDArray[np.int64],
    power: NDArray[np.float64],
    unknown: NDArray[np.float64],
    out: NDArray[np.complex64],
) -> float:
    """By how much to correct gains that later symbols contradict by `error` `[n_used]`.

    A Kalman filter a group: `unknown` is the variance of what is not known of it. The channel moves
    by `drift` times its `power`; returned is that drift, corrected by how much the errors exceed
    what noise and ignorance explain.
    """
    n = error.size
    turn, planes = np.empty(n, np.complex64), np.empty((2, n), np.float32)
    coefficients = np.empty((2, basis.shape[0]), np.float32)
    energies, weights = np.empty(power.size), np.empty(power.size)
    lean(-delay, carriers, turn)
    # Groups in which nothing was found count as noise, all together.
    wanted = power[: ends.size] > 0
    _centre(error, turn, basis, ends, wanted, planes, coefficients, energies)
    excess, chance, total = 0.0, 0.0, 0.0
    for group in range(power.size):
        size = _size(group, ends, n)
        expected = variance + unknown[group]
        excess += energies[group] - size * expected
        chance += size * expected * expected
        total += size * power[group]
    if total > 0:
        seen = max(0.0, (excess - 2 * math.sqrt(chance)) / total)
        drift += (_DRIFT_RISE if seen > drift else _DRIFT_FALL) * (seen - drift)
    for group in range(power.size):
        before = unknown[group] + drift * power[group]
        weights[group] = before / (before + variance)
        unknown[group] = before * (1 - weights[group])
    _weigh(weights, turn, basis, ends, planes, coefficients, out)
    return drift
