"""FFT bins to LLRs: follow phase and timing by the pilots, equalise, demap, de-interleave."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.viterbi import MAX_LLR

# Rows of the tracking state: [value, rate, var(value), cov, var(rate)].
PHASE, SLOPE = 0, 1
# Process noise a symbol: phase noise of the oscillators, and what the models leave out.
PHASE_NOISE = np.array([5e-5, 1e-10])
SLOPE_NOISE = np.array([1e-10, 1e-15])

# Times the noise of the preamble at which a symbol's pilots are no longer believed.
SURPRISE = 6.0

LLR_SCALE = 8.0
"""Quantised LLRs are 1/8 each."""


@njit(nogil=True, cache=True)
def _predict(state: NDArray[np.float64], noise: NDArray[np.float64]) -> None:
    """One symbol on: the value moves by its rate."""
    state[0] += state[1]
    state[2] += 2 * state[3] + state[4] + noise[0]
    state[3] += state[4]
    state[4] += noise[1]


@njit(nogil=True, cache=True)
def _correct(state: NDArray[np.float64], innovation: float, variance: float) -> None:
    """A measurement that differs from the prediction by `innovation` (Kalman)."""
    total = state[2] + variance
    gain, rate_gain = state[2] / total, state[3] / total
    state[0] += gain * innovation
    state[1] += rate_gain * innovation
    state[4] -= rate_gain * state[3]
    state[3] -= gain * state[3]
    state[2] -= gain * state[2]


@njit(nogil=True, cache=True)
def _track(
    y: NDArray[np.complex64],
    h_hat: NDArray[np.complex64],
    no: float,
    pilot_bins: NDArray[np.int64],
    pilot_carriers: NDArray[np.int64],
    pilots: NDArray[np.float32],
    polarity: float,
    tracking: NDArray[np.float64],
    turned: NDArray[np.complex128],
) -> None:
    """Advance phase and slope over carriers to this symbol, and correct them by its pilots."""
    phase, slope = tracking[PHASE], tracking[SLOPE]
    _predict(phase, PHASE_NOISE)
    _predict(slope, SLOPE_NOISE)
    n = pilot_bins.size
    total = 0j
    for p in range(n):
        at = pilot_bins[p]
        angle = -(phase[0] + slope[0] * pilot_carriers[p])
        reference = complex(h_hat[at]) * pilots[p] * polarity
        turned[p] = (
            complex(y[at]) * reference.conjugate() * complex(math.cos(angle), math.sin(angle))
        )
        total += turned[p]
    size = abs(total)
    if size == 0.0:
        return
    common = total / size
    # Interference that the preamble has not seen: trust these pilots as far as they agree.
    residual = 0.0
    for p in range(n):
        h = complex(h_hat[pilot_bins[p]])
        power = h.real * h.real + h.imag * h.imag
        if power > 0.0:
            error = turned[p] * common.conjugate() - power
            residual += (error.real * error.real + error.imag * error.imag) / power
    if residual > SURPRISE * n * no:
        no = residual / n
    # Weighted least squares of the pilots' phases: w (θ − a − b k)², small angles.
    s0 = s1 = s2 = t0 = t1 = 0.0
    for p in range(n):
        k = pilot_carriers[p]
        h = complex(h_hat[pilot_bins[p]])
        weight = h.real * h.real + h.imag * h.imag
        theta = (turned[p] * common.conjugate()).imag
        s0 += weight
        s1 += weight * k
        s2 += weight * k * k
        t0 += theta
        t1 += theta * k
    det = s0 * s2 - s1 * s1
    if not det > 0.0:
        return
    offset = math.atan2(common.imag, common.real)
    _correct(phase, offset + (s2 * t0 - s1 * t1) / det, 0.5 * no * s2 / det)
    _correct(slope, (s0 * t1 - s1 * t0) / det, 0.5 * no * s0 / det)


@njit(nogil=True, cache=True)
def _axis_llrs(
    u: NDArray[np.float32],
    weight: NDArray[np.float32],
    axis_bits: int,
    out: NDArray[np.int16],
) -> None:
    """Exact max-log LLRs of a Gray-coded axis, quantised: `out` `[axis_bits · n]`, bit by bit.

    `u` `[n]` in units of half a point distance. An LLR is the difference of squared distances to
    the nearest points with the bit 1 and 0; as a function of |u| it is a few straight lines.
    """
    n = u.size
    four, most = np.float32(4), np.float32(MAX_LLR)
    first = out[:n]
    for d in range(n):
        a = abs(u[d])
        outer = four * a
        if axis_bits >= 2:
            outer = max(outer, 2 * four * a - 2 * four)
        if axis_bits == 3:
            outer = max(outer, max(3 * four * a - 6 * four, 4 * four * a - 12 * four))
        signed = -outer if u[d] > 0 else outer
        first[d] = np.int16(min(max(weight[d] * signed, -most), most))
    if axis_bits == 2:
        second = out[n:]
        for d in range(n):
            value = four * abs(u[d]) - 2 * four
            second[d] = np.int16(min(max(weight[d] * value, -most), most))
    if axis_bits == 3:
        second, third = out[n:], out[2 * n :]
        for d in range(n):
            a = abs(u[d])
            inner = min(2 * four * a - 6 * four, four * a - 4 * four)
            value = max(inner, 2 * four * a - 10 * four)
            second[d] = np.int16(min(max(weight[d] * value, -most), most))
            value = max(2 * four - four * a, four * a - 6 * four)
            third[d] = np.int16(min(max(weight[d] * value, -most), most))


@njit(nogil=True, cache=True)
def _folded_llrs(
    u: NDArray[np.float32],
    weight: NDArray[np.float32],
    axis_bits: int,
    out: NDArray[np.int16],
) -> None:
    """The same for any number of bits: each bit but the first is the first of a folded axis.

    The first bit's LLR of an axis of 2 m levels is ±max over k ≤ m of 4 k |u| − 4 k (k − 1).
    """
    n = u.size
    most = np.float32(MAX_LLR)
    folded, outer = u.copy(), np.empty(n, np.float32)
    for bit in range(axis_bits):
        half = 1 << (axis_bits - 1 - bit)
        outer[:] = 0
        for k in range(1, half + 1):
            slope, offset = np.float32(4 * k), np.float32(4 * k * (k - 1))
            for d in range(n):
                outer[d] = max(outer[d], slope * abs(folded[d]) - offset)
        row = out[bit * n : (bit + 1) * n]
        toward = np.float32(-1 if bit == 0 else 1)
        for d in range(n):
            value = toward * outer[d] if folded[d] > 0 else -toward * outer[d]
            row[d] = np.int16(min(max(weight[d] * value, -most), most))
            folded[d] = abs(folded[d]) - np.float32(half)


@njit(nogil=True, cache=True)
def _turns(phase: float, slope: float, edge: int, out: NDArray[np.complex64]) -> None:
    """exp(−j (phase + slope · k)) for the carriers k = −edge … edge `[2 edge + 1]`."""
    common = complex(math.cos(phase), -math.sin(phase))
    step = complex(math.cos(slope), -math.sin(slope))
    turn = complex(1.0)
    out[edge] = np.complex64(common)
    for k in range(1, edge + 1):
        turn *= step
        out[edge + k] = np.complex64(common * turn)
        out[edge - k] = np.complex64(common * turn.conjugate())


@njit(nogil=True, cache=True)
def demap(
    y: NDArray[np.complex64],
    h_hat: NDArray[np.complex64],
    no: float,
    data_bins: NDArray[np.int64],
    data_carriers: NDArray[np.int64],
    pilot_bins: NDArray[np.int64],
    pilot_carriers: NDArray[np.int64],
    pilots: NDArray[np.float32],
    polarity: NDArray[np.float32],
    gather: NDArray[np.int32],
    bits: int,
    unit: float,
    edge: int,
    tracking: NDArray[np.float64],
    equalised: NDArray[np.complex64],
    llr: NDArray[np.int16],
) -> None:
    """Symbols `y` `[n, n_fft]` to LLRs `[n · n_data · bits]` in the code's order, positive for 0.

    `h_hat` `[n_fft]`, `no` the noise power on a carrier. `tracking` `[2, 5]` goes on from call to
    call. `equalised` `[n, n_data]` gets the points. `gather` `[n_data · bits]`: where each bit of
    the code's order is when a symbol's bits lie plane by plane.
    """
    n_data = data_bins.size
    axis_bits = max(1, bits // 2)
    equaliser = np.empty(n_data, np.complex64)
    weight = np.empty(n_data, np.float32)
    for d in range(n_data):
        h = complex(h_hat[data_bins[d]])
        power = h.real * h.real + h.imag * h.imag
        weight[d] = np.float32(LLR_SCALE * unit * unit * power / no)
        equaliser[d] = np.complex64(h.conjugate() / power) if power > 0.0 else np.complex64(0)
    u, v = np.empty(n_data, np.float32), np.empty(n_data, np.float32)
    planes = np.empty(gather.size, np.int16)
    turns = np.empty(2 * edge + 1, np.complex64)
    turned = np.empty(pilot_bins.size, np.complex128)
    per_unit = np.float32(1 / unit)
    for row in range(y.shape[0]):
        _track(
            y[row], h_hat, no, pilot_bins, pilot_carriers, pilots, polarity[row], tracking, turned
        )
        _turns(tracking[PHASE, 0], tracking[SLOPE, 0], edge, turns)
        for d in range(n_data):
            value = y[row, data_bins[d]] * equaliser[d] * turns[data_carriers[d] + edge]
            equalised[row, d] = value
            u[d] = value.real * per_unit
            v[d] = value.imag * per_unit
        other = planes[axis_bits * n_data :]
        if axis_bits > 3:
            _folded_llrs(u, weight, axis_bits, planes)
            _folded_llrs(v, weight, axis_bits, other)
        else:
            _axis_llrs(u, weight, axis_bits, planes)
            if bits > 1:
                _axis_llrs(v, weight, axis_bits, other)
        sorted_llr = llr[row * gather.size : (row + 1) * gather.size]
        for k in range(gather.size):
            sorted_llr[k] = planes[gather[k]]
