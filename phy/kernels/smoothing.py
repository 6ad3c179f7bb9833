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
from phy.tables.burst import (
    DELAY,
    DOUBT,
    DRIFT,
    DUE,
    MOVES,
    N_FOLLOWED,
    N_ODD,
    NO,
    PHASE,
    SCALED,
    SPREAD,
    TURNS,
    Channel,
    Planes,
    Scratch,
    Tones,
)

# Rates at which the drift estimate of a channel follows the observations.
_DRIFT_RISE, _DRIFT_FALL = 1.0, 0.0125
# The drift that speeds tell, for certainty, is multiplied by this.
_TURNING = 2.0
LONGEST = 8
"""Number of symbols from one correction of a channel that stands still to the next."""
# Errors of fewer symbols tell as little of a drift as those of so many.
_SHORTEST = 4
# Number of standard deviations that is chance: for what stands still, and for what moves.
_SURELY_MOVES, _MOVES_ON = 4.0, 2.5
# Variance of the speed in a new burst, as a share of the power; by how many symbols the estimate is
# older than the last symbol that it is made of.
_SPEED, _OLD = 2e-5, 1.5
# A channel that will not move by as much in so many symbols stands still.
_FAR = 24
# Variance in rad² of the phase that is not taken for movement; in a fade, it has more.
_MOST_JITTER = 1e-4
# By this share of the noise, gains may become less certain from one correction to the next.
_LITTLE = 0.125


@njit(nogil=True, cache=True, error_model="numpy")
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
def _join(row: int, tones: Tones, scratch: Scratch) -> None:
    """Write `rest` to `joined`, each group times its weight, which is in a `row` of the weights."""
    rest, basis, coefficients = scratch.rest, tones.basis, scratch.coefficients
    weights, width, out = scratch.weights[row], scratch.rest.shape[1], scratch.joined
    usual, first = weights[tones.ends.size], 0
    for k in range(0, 2 * width, N_LANES):
        # The last group has no rows: apply its weight to all of `rest`, then correct the other
        # groups.
        store(out, k, load(rest, k) * splat(usual))
    for group in range(tones.ends.size):
        more = np.float32(weights[group] - usual)
        if scratch.energies[group] > 0 and more != 0:
            for d in range(first, tones.ends[group]):
                re, im = splat(more * coefficients[0, d]), splat(more * coefficients[1, d])
                for k in range(0, width, N_LANES):
                    along = load(basis, d * width + k)
                    store(out, k, load(out, k) + along * re)
                    store(out, width + k, load(out, width + k) + along * im)
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


@njit(nogil=True, cache=True, error_model="numpy")
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
        scratch.weights[0, group] = weight
        channel.unknown[0, group] = weight * variance
        channel.power[group] = weight * energy / size
    _join(0, tones, scratch)
    multiply(scratch.joined, channel.centre, True, channel.h)


@step
def start(tones: Tones, channel: Channel) -> None:
    """Begin to follow the gains that were just estimated; how fast they move is not known."""
    stand_still(channel)
    figures, unknown = channel.figures, channel.unknown
    figures[SPREAD], figures[SCALED], figures[MOVES] = 0, 1, 1
    figures[TURNS] = figures[N_FOLLOWED] = figures[N_ODD] = 0
    for group in range(channel.power.size):
        speed = _SPEED * channel.power[group]
        unknown[0, group] += _OLD * _OLD * speed
        unknown[1, group], unknown[2, group] = _OLD * speed, speed
    _sum_doubt(tones, channel)
    figures[DUE] = _next(figures[NO], tones, channel)


@step
def stand_still(channel: Channel) -> None:
    """Take the gains to have no speed."""
    channel.speed[:] = 0
    for group in range(channel.power.size):
        channel.unknown[1, group] = channel.unknown[2, group] = 0.0
    channel.figures[DRIFT] = channel.figures[MOVES] = 0


@step
def _sum_doubt(tones: Tones, channel: Channel) -> None:
    doubt = 0.0
    for group in range(channel.power.size):
        doubt += _size(group, tones) * channel.unknown[0, group]
    channel.figures[DOUBT] = doubt / tones.bins.size


@step
def move_on(tones: Tones, channel: Channel) -> None:
    """Move the gains on to the next symbol, each by its speed."""
    unknown, h, speed, width = channel.unknown, channel.h, channel.speed, channel.masses.size
    drift = channel.figures[DRIFT]
    for group in range(channel.power.size):
        noise = drift * channel.power[group]
        unknown[0, group] += 2 * unknown[1, group] + unknown[2, group] + noise / 3
        unknown[1, group] += unknown[2, group] + noise / 2
        unknown[2, group] += noise
        _limit(group, channel)
    _sum_doubt(tones, channel)
    for k in range(0, width, N_LANES):
        re, im, mass = load(speed, k), load(speed, width + k), load(channel.masses, k)
        store(h, k, load(h, k) + re)
        store(h, width + k, load(h, width + k) + im)
        # So that what is left of the sums, less the gains, remains the same.
        store(channel.sums, k, load(channel.sums, k) + re * mass)
        store(channel.sums, width + k, load(channel.sums, width + k) + im * mass)


@step
def _limit(group: int, channel: Channel) -> None:
    """Not more can be unknown of a gain than the gain has power."""
    unknown, most = channel.unknown, channel.power[group]
    if unknown[0, group] > most:
        share = most / unknown[0, group]
        unknown[0, group] = most
        unknown[1, group] *= share
        unknown[2, group] *= share


@step
def scale(amplitude: float, channel: Channel) -> None:
    """Multiply all gains: the receiver's gain, or the sender's power, has changed.

    Speeds are forgotten: if they were wrong, the amplitude would follow them.
    """
    factor, power = splat(amplitude), amplitude * amplitude
    for k in range(0, channel.h.size, N_LANES):
        store(channel.h, k, load(channel.h, k) * factor)
        store(channel.sums, k, load(channel.sums, k) * factor)
    channel.speed[:] = 0
    for group in range(channel.power.size):
        channel.power[group] *= power
        channel.unknown[0, group] *= power
        channel.unknown[1, group], channel.unknown[2, group] = 0, _SPEED * channel.power[group]
    channel.figures[DOUBT] *= power
    channel.figures[SCALED] *= amplitude
    channel.figures[MOVES] = 1


@step
def doubt_more(excess: float, tones: Tones, channel: Channel) -> None:
    """Note that the gains' errors have more mean power than is thought, by `excess`."""
    whole = 0.0
    for group in range(channel.power.size):
        whole += _size(group, tones) * channel.power[group]
    if whole <= 0:
        return
    share = excess * tones.bins.size / whole
    for group in range(channel.power.size):
        channel.unknown[0, group] += share * channel.power[group]
        _limit(group, channel)
    _sum_doubt(tones, channel)


@njit(nogil=True, cache=True, error_model="numpy")
def follow(
    error: Planes, variance: float, n: int, tones: Tones, channel: Channel, scratch: Scratch
) -> None:
    """Correct gains and speeds by `error` `[2, width]`, the mean deviation of `n` symbols.

    `error` is overwritten. Each group has a Kalman filter of gain and speed. The speed changes by
    the drift times the group's power; the drift follows the excess of the errors over noise and
    uncertainty.
    """
    power, unknown, energies, figures = (
        channel.power,
        channel.unknown,
        scratch.energies,
        channel.figures,
    )
    multiply(error, channel.centre, False, scratch.rest)
    # Groups in which nothing was found count as noise, all together.
    _split(tones, power, scratch)
    noise, n_noise, last = energies[power.size - 1], 0, power.size - 1
    for group in range(power.size):
        if group == last or power[group] <= 0:
            n_noise += _size(group, tones)
    # What is there where nothing was found, is noise that the preamble did not have.
    variance = max(variance, noise / n_noise)
    # Nor is it movement if the phase is wrong by which symbols were turned back.
    jitter = min(channel.tracking[PHASE, 2], _MOST_JITTER)
    excess, chance, whole = 0.0, 0.0, 0.0
    for group in range(last):
        if power[group] > 0:
            size = _size(group, tones)
            expected = variance + jitter * power[group] + unknown[0, group]
            excess += energies[group] - size * expected
            chance += size * expected * expected
            whole += size * power[group]
    drift, more = figures[DRIFT], 0.0
    if whole > 0:
        since = max(n, _SHORTEST)
        surely = _MOVES_ON if drift > 0 else _SURELY_MOVES
        moved = min(max(0.0, (excess - surely * math.sqrt(chance)) / whole), 1.0)
        seen = moved * 3 / (since * since * since)
        more = max(0.0, _DRIFT_RISE * (seen - drift))
        figures[DRIFT] += more if seen > drift else _DRIFT_FALL * n * (seen - drift)
    moves = figures[MOVES] > 0 or figures[DRIFT] > 0
    for group in range(power.size):
        grown = more * power[group]
        a = unknown[0, group] + grown * n * n * n / 3
        b = unknown[1, group] + grown * n * n / 2
        c = unknown[2, group] + grown * n
        weight, rate = a / (a + variance), b / (a + variance)
        scratch.weights[0, group], scratch.weights[1, group] = weight, rate
        unknown[0, group] = a * (1 - weight)
        unknown[1, group] = b * (1 - weight)
        unknown[2, group] = c - rate * b
    _join(0, tones, scratch)
    multiply(scratch.joined, channel.centre, True, error)
    add(channel.h, error)
    if moves:
        _join(1, tones, scratch)
        multiply(scratch.joined, channel.centre, True, error)
        add(channel.speed, error)
        figures[MOVES] = 1
        _grow(whole, channel)
        turning = _turning(channel)
        _turn(whole, turning, channel)
        figures[TURNS] += n * _turns(whole, turning, tones, channel)
        if _is_still(variance * n, turning, tones, channel):
            # The phase's filter must go on alone, so it no longer turns against the gains.
            channel.tracking[PHASE, 1] += turning
            stand_still(channel)
    figures[N_FOLLOWED] += n
    _sum_doubt(tones, channel)
    figures[DUE] = _next(variance * n, tones, channel)


@step
def _turns(whole: float, turning: float, tones: Tones, channel: Channel) -> float:
    """The squared turn of echoes in a symbol that speeds surely tell, in rad²; see `_turn`."""
    speed = _own_speed(turning, channel)
    for group in range(channel.power.size):
        speed -= _size(group, tones) * channel.unknown[2, group]
    return 2 * max(0.0, speed) / whole if whole > 0 else 0.0


@step
def _turning(channel: Channel) -> float:
    """By how many radians a symbol the speeds turn all gains alike."""
    h, speed, width = channel.h, channel.speed, channel.masses.size
    turning: Lanes = splat(0)
    for k in range(0, width, N_LANES):
        re, im = load(h, k), load(h, width + k)
        turning = turning + (re * load(speed, width + k) - im * load(speed, k))
    return float(total(turning)) / max(_power(h), 1e-30)


@step
def _own_speed(turning: float, channel: Channel) -> float:
    """The power of the speeds without that `turning`, which is a phase's and no movement."""
    return max(0.0, _power(channel.speed) - turning * turning * _power(channel.h))


@step
def _grow(whole: float, channel: Channel) -> None:
    """Let the groups' power, `whole` in all, be at least what the gains have now."""
    more = _power(channel.h)
    if more > whole > 0:
        for group in range(channel.power.size):
            channel.power[group] *= more / whole


@step
def _turn(whole: float, turning: float, channel: Channel) -> None:
    """Let the drift be at least what turns such speeds, if all echoes have the same Doppler.

    A gain of mean power 1 that turns by w radians a symbol has the mean square speed w² / 2, and
    the speed changes by 3 w⁴ / 8 (Jakes).
    """
    speed = _own_speed(turning, channel)
    share = speed / whole if whole > 0 else 0.0
    channel.figures[DRIFT] = max(channel.figures[DRIFT], _TURNING * 1.5 * share * share)


@step
def _power(x: Planes) -> float:
    """Sum of the squares."""
    sums: Lanes = splat(0)
    for k in range(0, x.size, N_LANES):
        sums = sums + load(x, k) * load(x, k)
    return float(total(sums))


@step
def _is_still(noise: float, turning: float, tones: Tones, channel: Channel) -> bool:
    """Whether the gains will have moved by little beside the noise, far from now."""
    speed = _own_speed(turning, channel)
    for group in range(channel.power.size):
        drift = channel.figures[DRIFT] * channel.power[group] * _FAR / 3
        speed += _size(group, tones) * (channel.unknown[2, group] + drift)
    return speed * _FAR * _FAR < _LITTLE * noise * tones.bins.size


@step
def _next(noise: float, tones: Tones, channel: Channel) -> int:
    """Number of symbols after which the channel will have moved by little beside the noise."""
    n = LONGEST
    while n > 1:
        grown = 0.0
        for group in range(channel.power.size):
            b, c = channel.unknown[1, group], channel.unknown[2, group]
            more = channel.figures[DRIFT] * channel.power[group] * n / 3
            grown += _size(group, tones) * n * (2 * b + n * (c + more))
        if grown <= _LITTLE * noise * tones.bins.size:
            break
        n //= 2
    return n


@step
def add(x: Planes, more: Planes) -> None:
    """Add `more` to `x`, in place."""
    for k in range(0, x.size, N_LANES):
        store(x, k, load(x, k) + load(more, k))
