"""Smoothing: removes probable noise from the channel estimate, and later follows the channel.

A channel has few echoes. Rotated back by its mean delay, its gains are smooth over the subcarriers,
so that most of their power is in few of the functions 1, cos k, sin k, cos 2k, … Noise is equally
in all of them.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from phy.numerology import Numerology
from phy.reference.channel import LONGEST, Channel
from phy.reference.ofdm import Subcarriers
from phy.reference.tracking import Kalman

GROUPS = ((0,), (1,), (2, 3), (4, 5, 6, 7, 8))
"""Delays of each group's echoes from the mean delay; one more group has all up to a prefix."""
DRIFT_RISE, DRIFT_FALL = 1.0, 0.0125
"""Rates at which the drift estimate rises with the observations, and falls in each symbol."""
TURNING = 2.0
"""The drift that speeds tell, for certainty, is multiplied by this."""
SHORTEST = 4
"""Errors of fewer symbols tell as little of a drift as those of so many."""
SURELY_MOVES, MOVES_ON = 4.0, 2.5
"""Number of standard deviations that is chance: for what stands still, and for what moves."""
SPEED, OLD = 2e-5, 1.5
"""Variance of the speed in a new burst, as a share of the power; by how many symbols the estimate
is older than the last symbol that it is made of."""
FAR = 24
"""A channel that will not move by as much in so many symbols stands still."""
MOST_JITTER = 1e-4
"""Variance in rad² of the phase that is not taken for movement; in a fade, it has more."""
LITTLE = 0.125
"""By this share of the noise, gains may become less certain from one correction to the next."""


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
    channel.unknown = np.array([kept * variance, 0 * kept, 0 * kept])
    channel.power = kept * e / m
    channel.h = centred(kept @ parts, -channel.delay, grid)
    start(channel, grid)


def start(channel: Channel, grid: Numerology) -> None:
    """Begin to follow the gains that were just estimated; how fast they move is not known."""
    speed = SPEED * channel.power
    channel.unknown = np.array([channel.unknown[0] + OLD**2 * speed, OLD * speed, speed])
    channel.moves, channel.speed = True, np.zeros(grid.n_used, np.complex128)
    channel.turns, channel.n_followed, channel.n_odd = 0.0, 0, 0
    sum_doubt(channel, grid)
    channel.due = _next(channel.no, channel, grid)


def sum_doubt(channel: Channel, grid: Numerology) -> None:
    """Compute the gains' mean variance from that of the groups."""
    channel.doubt = float(np.sum(sizes(grid) * channel.unknown[0]) / grid.n_used)


def move_on(channel: Channel, grid: Numerology) -> None:
    """Move the gains on to the next symbol, each by its speed.

        a += 2b + c + q/3;  b += c + q/2;  c += q;  q = drift · power

    a and c are the variances of gain and speed, b is their covariance.
    """
    q = channel.drift * channel.power
    a, b, c = channel.unknown
    channel.unknown = np.array([a + 2 * b + c + q / 3, b + c + q / 2, c + q])
    _limit(channel)
    sum_doubt(channel, grid)
    channel.h = channel.h + channel.speed


def _limit(channel: Channel) -> None:
    """Not more can be unknown of a gain than the gain has power."""
    a = channel.unknown[0]
    channel.unknown = channel.unknown * np.minimum(1, channel.power / np.maximum(a, 1e-300))


def doubt_more(excess: float, channel: Channel, grid: Numerology) -> None:
    """Note that the gains' errors have more mean power than is thought, by `excess`."""
    whole = float(np.sum(sizes(grid) * channel.power))
    if whole <= 0:
        return
    channel.unknown[0] += excess * grid.n_used / whole * channel.power
    _limit(channel)
    sum_doubt(channel, grid)


def scale(amplitude: float, channel: Channel) -> None:
    """Multiply all gains: the receiver's gain, or the sender's power, has changed.

    Speeds are forgotten: if they were wrong, the amplitude would follow them.
    """
    channel.h = channel.h * amplitude
    channel.speed, channel.moves = np.zeros_like(channel.h), True
    channel.power = channel.power * amplitude**2
    a = channel.unknown[0] * amplitude**2
    channel.unknown = np.array([a, 0 * a, SPEED * channel.power])
    channel.doubt *= amplitude**2
    channel.scaled *= amplitude


def follow(
    error: Subcarriers, variance: float, n: int, phase: Kalman, channel: Channel, grid: Numerology
) -> None:
    """Move the channel towards the last `n` symbols, which deviate from it by `error` `[n_used]`.

        Ĥ += a / (a + v) · error;  speed += b / (a + v) · error

    This is a Kalman filter of gain and speed for each group, where v is the `variance` of the
    error; see `move_on`. The drift follows the excess of the errors over noise and uncertainty,
    beyond some standard deviations. Groups in which nothing was found count as noise, all together.
    """
    m, power = sizes(grid), channel.power
    parts = split(centred(error, channel.delay, grid), power > 0, grid)
    e, found = energies(parts), power > 0
    # The last group is of no channel. What is there, and where nothing was found, is noise.
    found[-1] = False
    variance = max(variance, float(e[-1] / np.sum(m[~found])))
    # Nor is it movement if the phase is wrong by which symbols were turned back.
    jitter = min(phase.covariance[0], MOST_JITTER)
    expected = variance + jitter * power + channel.unknown[0]
    excess = np.sum((e - m * expected)[found])
    chance = np.sqrt(np.sum((m * expected**2)[found]))
    whole, more = float(np.sum((m * power)[found])), 0.0
    if whole > 0:
        # So much of the speed's variance would explain the excess, had it come in n symbols.
        surely = MOVES_ON if channel.drift > 0 else SURELY_MOVES
        moved = float((excess - surely * chance) / whole)
        seen = min(max(0.0, moved), 1.0) * 3 / max(n, SHORTEST) ** 3
        more = max(0.0, DRIFT_RISE * (seen - channel.drift))
        channel.drift += more if more > 0 else DRIFT_FALL * n * (seen - channel.drift)
    q = more * power
    a, b, c = channel.unknown + np.array([q * n**3 / 3, q * n**2 / 2, q * n])
    weight, rate = a / (a + variance), b / (a + variance)
    channel.unknown = np.array([a * (1 - weight), b * (1 - weight), c - rate * b])
    channel.h = channel.h + centred(weight @ parts, -channel.delay, grid)
    if channel.moves or channel.drift > 0:
        channel.moves = True
        channel.speed = channel.speed + centred(rate @ parts, -channel.delay, grid)
        _grow(whole, channel)
        turning = _turning(channel)
        _turn(whole, turning, channel)
        channel.turns += n * _turns(whole, turning, channel, grid)
        if _is_still(variance * n, turning, channel, grid):
            # The phase's filter must go on alone, so it no longer turns against the gains.
            phase.rate += turning
            channel.moves, channel.drift = False, 0.0
            channel.speed = np.zeros(grid.n_used, np.complex128)
            channel.unknown[1:] = 0
    channel.n_followed += n
    sum_doubt(channel, grid)
    channel.due = _next(variance * n, channel, grid)


def _turns(whole: float, turning: float, channel: Channel, grid: Numerology) -> float:
    """The squared turn of echoes in a symbol that speeds surely tell, in rad²; see `_turn`."""
    surely = _own_speed(turning, channel) - float(np.sum(sizes(grid) * channel.unknown[2]))
    return 2 * max(0.0, surely) / whole if whole > 0 else 0.0


def _grow(whole: float, channel: Channel) -> None:
    """Let the groups' power, `whole` in all, be at least what the gains have now."""
    power = np.sum(np.abs(channel.h) ** 2)
    if power > whole > 0:
        channel.power = channel.power * (power / whole)


def _turn(whole: float, turning: float, channel: Channel) -> None:
    """Let the drift be at least what turns such speeds, if all echoes have the same Doppler.

    A gain of mean power 1 that turns by w radians a symbol has the mean square speed w² / 2, and
    the speed changes by 3 w⁴ / 8 (Jakes).
    """
    share = _own_speed(turning, channel) / whole if whole > 0 else 0.0
    channel.drift = max(channel.drift, TURNING * 1.5 * share**2)


def _turning(channel: Channel) -> float:
    """By how many radians a symbol the speeds turn all gains alike."""
    along = float(np.sum(channel.h.conj() * channel.speed).imag)
    return along / max(float(np.sum(np.abs(channel.h) ** 2)), 1e-30)


def _own_speed(turning: float, channel: Channel) -> float:
    """The power of the speeds without that `turning`, which is a phase's and no movement."""
    whole, power = (float(np.sum(np.abs(x) ** 2)) for x in (channel.speed, channel.h))
    return max(0.0, whole - turning**2 * power)


def _is_still(noise: float, turning: float, channel: Channel, grid: Numerology) -> bool:
    """Whether the gains will have moved by little beside the noise, far from now."""
    c = channel.unknown[2] + channel.drift * channel.power * FAR / 3
    speed = _own_speed(turning, channel) + np.sum(sizes(grid) * c)
    return bool(speed * FAR**2 < LITTLE * noise * grid.n_used)


def _next(noise: float, channel: Channel, grid: Numerology) -> int:
    """Number of symbols after which the channel will have moved by little beside the noise."""
    _, b, c = channel.unknown
    n = LONGEST
    while n > 1:
        grown = n * (2 * b + n * (c + channel.drift * channel.power * n / 3))
        if np.sum(sizes(grid) * grown) <= LITTLE * noise * grid.n_used:
            break
        n //= 2
    return n
