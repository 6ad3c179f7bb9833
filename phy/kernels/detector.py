"""The preamble detector: the metric of a sample is a fixed tree of sums over 192 samples.

There is no running sum from sample to sample, so nothing drifts, every loop is vectorised, and the
result does not depend on how the stream was cut into chunks.

Almost all hops of a quiet air have no more power than noise has. The metric is not computed there,
once as many of them have been searched in vain. So a search that begins within a burst stays open.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, load, pairs, splat, total
from phy.kernels.openers import open_search
from phy.sizes import N_LANES
from phy.tables.block import PackedArguments
from phy.tables.detector import (
    ABOVE,
    DC_IMAG,
    DC_REAL,
    FLOOR,
    FORGETS,
    HISTORY,
    HOPS,
    LOWER,
    PATIENCE,
    SEGMENT,
    SHORT,
    SURE,
)

GATE = 1.15
"""A half of a hop with more power than this times the noise is searched."""
_WEIGHT = 1 / 64

# E is over 192 samples, P over the 176 products of samples 16 apart.
_SHARE = np.float32((SHORT - SEGMENT) / SHORT)


@njit(nogil=True, cache=True, error_model="numpy")
def detector_sums(x: NDArray[np.complex64], dc: complex, work: NDArray[np.float32], n: int) -> None:
    """P (rows 0, 1: real, imaginary) and E (row 2) of the `n` samples after HISTORY of `x`.

    P[n] = Σ_k b_k Σ_m x[n − 16 (10 − k) − m] x*[n − 16 (11 − k) − m], b the Barker code, m = 0…15;
    E[n] = Σ |x|² over the 192 samples that end at n, times 11/12. `work` is `[7, HISTORY + n]`.
    """
    size = HISTORY + n
    re, im = work[5, :size], work[6, :size]
    dc_re, dc_im = np.float32(dc.real), np.float32(dc.imag)
    for i in range(size):
        re[i] = x[i].real - dc_re
        im[i] = x[i].imag - dc_im
    # Products of samples 16 apart, and powers of samples.
    p_re, p_im, power = work[0], work[1], work[2]
    late_re, late_im = re[SEGMENT:], im[SEGMENT:]
    for i in range(size - SEGMENT):
        p_re[i] = late_re[i] * re[i] + late_im[i] * im[i]
        p_im[i] = late_im[i] * re[i] - late_re[i] * im[i]
    for i in range(size):
        power[i] = re[i] * re[i] + im[i] * im[i]
    # Sums of 16 by repeated doubling; entry i is the sum that begins at i.
    a, b, c = work[3], work[4], work[5]
    _double(p_re, a, size - SEGMENT, 1)
    _double(a, p_re, size - SEGMENT - 1, 2)
    _double(p_re, a, size - SEGMENT - 3, 4)
    _double(a, p_re, size - SEGMENT - 7, 8)
    _double(p_im, a, size - SEGMENT, 1)
    _double(a, p_im, size - SEGMENT - 1, 2)
    _double(p_im, a, size - SEGMENT - 3, 4)
    _double(a, p_im, size - SEGMENT - 7, 8)
    _double(power, a, size, 1)
    _double(a, power, size - 1, 2)
    _double(power, a, size - 3, 4)
    _double(a, power, size - 7, 8)
    # 192 = 64 · 3.
    _double(power, a, size - 15, 16)
    _double(a, power, size - 31, 32)
    energy_0, energy_1, energy_2 = power, power[64:], power[128:]
    for i in range(n):
        c[i] = _SHARE * (energy_0[i] + energy_1[i] + energy_2[i])
    _despread(p_re, a, n)
    _despread(p_im, b, n)
    for i in range(n):
        p_re[i], p_im[i], power[i] = a[i], b[i], c[i]


@step
def _double(x: NDArray[np.float32], out: NDArray[np.float32], n: int, step: int) -> None:
    later = x[step:]
    for i in range(n - step):
        out[i] = x[i] + later[i]


@step
def _despread(q: NDArray[np.float32], out: NDArray[np.float32], n: int) -> None:
    """Write Σ b_k q[i + 16 k] with the Barker code b = + + + − − − + − − + −."""
    q0, q1, q2, q3 = q, q[16:], q[32:], q[48:]
    q4, q5, q6, q7 = q[64:], q[80:], q[96:], q[112:]
    q8, q9, q10 = q[128:], q[144:], q[160:]
    for i in range(n):
        out[i] = (
            ((q0[i] + q1[i]) + (q2[i] - q3[i]))
            + ((q6[i] - q4[i]) - (q5[i] + q7[i]))
            + ((q9[i] - q8[i]) - q10[i])
        )


@njit(nogil=True, cache=True, error_model="numpy")
def search(
    x: NDArray[np.complex64],
    n_hops: int,
    hop: int,
    threshold: float,
    excess: float,
    age: int,
    memory_in: PackedArguments,
) -> int:
    """Index in `x` of the first sample with |P| > threshold · E, or -1 after `n_hops` hops.

    `x` begins HISTORY samples before the first hop; `hop` is a multiple of 8. The threshold was
    raised by `excess`, `age` samples before the first hop, and decays hop by hop. The estimates of
    DC and noise follow the hops without a crossing. Hops with the power of noise are taken to have
    none.
    """
    memory = open_search(memory_in)
    state, work = memory.state, memory.work
    for h in range(n_hops):
        begin = h * hop
        early, late, mean = _halves(x, begin + HISTORY, hop, state, work)
        is_above = max(early, late) > GATE * state[FLOOR]
        if is_above or state[SURE] < PATIENCE:
            level = threshold + excess * math.exp(-(age + h * hop) / FORGETS)
            found = _crossing(x[begin : begin + HISTORY + hop], hop, level, state, work)
            if found >= 0:
                return begin + found
        power = (early + late) / 2
        if power < LOWER * state[FLOOR] or abs(mean) ** 2 > power / 2:
            # A strong signal has ended, and its mean was no DC; or the DC has jumped.
            state[HOPS] = 0
        _follow_noise(power, is_above, state)
        state[HOPS] += 1
        # At first the mean of all hops, for quick settling; later of about the last 64.
        weight = max(_WEIGHT, 1 / state[HOPS])
        state[DC_REAL] += weight * mean.real
        state[DC_IMAG] += weight * mean.imag
    return -1


@step
def _follow_noise(power: float, is_above: bool, state: NDArray[np.float64]) -> None:
    """Learn from a hop without a crossing what power noise has."""
    if state[FLOOR] == 0 or power < LOWER * state[FLOOR]:
        state[FLOOR], state[SURE], state[ABOVE] = power, 0, 0
    elif not is_above:
        state[FLOOR] += _WEIGHT * (power - state[FLOOR])
        state[SURE], state[ABOVE] = min(state[SURE] + 1, PATIENCE), 0
    elif state[ABOVE] < PATIENCE:
        state[ABOVE] += 1
    else:
        # A permanent signal is noise.
        state[FLOOR], state[SURE], state[ABOVE] = power, PATIENCE, 0


@step
def _crossing(
    x: NDArray[np.complex64],
    hop: int,
    level: float,
    state: NDArray[np.float64],
    work: NDArray[np.float32],
) -> int:
    """Index in `x` of the first sample of the hop with |P| > level · E; -1: none."""
    limit = np.float32(level * level)
    detector_sums(x, complex(state[DC_REAL], state[DC_IMAG]), work, hop)
    p_re, p_im, energy = work[0], work[1], work[2]
    crossings = 0
    for i in range(hop):
        magnitude = p_re[i] * p_re[i] + p_im[i] * p_im[i]
        # Counted without a branch, so that hops without a crossing are vectorised.
        crossings += magnitude > limit * (energy[i] * energy[i])
    if crossings:
        for i in range(hop):
            magnitude = p_re[i] * p_re[i] + p_im[i] * p_im[i]
            if magnitude > limit * (energy[i] * energy[i]):
                return HISTORY + i
    return -1


@step
def _halves(
    x: NDArray[np.complex64],
    begin: int,
    hop: int,
    state: NDArray[np.float64],
    work: NDArray[np.float32],
) -> tuple[float, float, complex]:
    """(power of the first half of a hop, that of the second, mean of the hop), all about the DC."""
    parts, room = x.view(np.float32), work[0]
    for i in range(0, N_LANES, 2):
        room[i], room[i + 1] = state[DC_REAL], state[DC_IMAG]
    dc: Lanes = load(room, 0)
    none: Lanes = splat(0)
    sums, early, late = none, none, none
    # A sample has two parts.
    first, middle, last = 2 * begin, 2 * begin + hop, 2 * begin + 2 * hop
    for i in range(first, middle, N_LANES):
        part: Lanes = load(parts, i) - dc
        sums, early = sums + part, early + part * part
    for i in range(middle, last, N_LANES):
        part = load(parts, i) - dc
        sums, late = sums + part, late + part * part
    half = hop // 2
    return total(early) / half, total(late) / half, complex(pairs(sums)) / hop


@njit(nogil=True, cache=True, error_model="numpy")
def strongest(
    x: NDArray[np.complex64], n: int, memory_in: PackedArguments
) -> tuple[int, complex, float]:
    """(offset, P, |Q| / |P|) at the largest P / E of the `n` samples after HISTORY of `x`.

    Q is P without the code: small for our preamble, large for any signal that repeats every 16
    samples or rotates evenly.
    """
    memory = open_search(memory_in)
    state, work = memory.state, memory.work
    dc = complex(state[DC_REAL], state[DC_IMAG])
    detector_sums(x, dc, work, n)
    p_re, p_im, energy = work[0], work[1], work[2]
    best, best_metric = 0, -1.0
    for i in range(n):
        if energy[i] > 0:
            # In double precision: the square of a small float32 is 0.
            re, im, e = np.float64(p_re[i]), np.float64(p_im[i]), np.float64(energy[i])
            metric = (re * re + im * im) / (e * e)
            if metric > best_metric:
                best, best_metric = i, metric
    p = complex(p_re[best], p_im[best])
    # Silence: return the ratio that rules out a preamble.
    if best_metric <= 0:
        return best, p, 1.0
    plain = 0j
    for i in range(best + SEGMENT, best + SHORT):
        plain += (complex(x[i]) - dc) * (complex(x[i - SEGMENT]) - dc).conjugate()
    return best, p, abs(plain) / abs(p)


@njit(nogil=True, cache=True, error_model="numpy")
def sanitise(x: NDArray[np.complex64], limit: float) -> int:
    """Set samples that are not finite or exceed `limit` to 0; returns their number."""
    most, n_good = np.float32(limit), 0
    parts = x.view(np.float32)
    for i in range(parts.size):
        # The comparison is also false for NaN. Bad samples are rare, so this branch-free loop is
        # vectorised.
        n_good += abs(parts[i]) < most
    if n_good == parts.size:
        return 0
    bad = 0
    for i in range(x.size):
        good = (abs(x[i].real) < most) & (abs(x[i].imag) < most)
        bad += not good
        x[i] = x[i] if good else np.complex64(0)
    return bad
