"""The simulated air, the carrier's sense and the resampling in NumPy.

They take what the kernels of the same names take; see there for the formats.
"""

from collections.abc import Callable

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from phy.reference.blanking import blank, find_pulses
from phy.reference.notch import cut_lines, find_lines
from phy.sizes import NOISE_CHUNK, SENSE_WINDOW
from phy.tables.sensing import (
    APART,
    BUSY_UNTIL,
    CARRIER_UNTIL,
    EXPLAINED_UNTIL,
    FILLED,
    FLOOR,
    LEAST_FLOOR,
    LEAST_PULSE,
    MOST_PULSE,
    MOST_SHORT,
    N_SHORT,
    NEXT,
    POWERS,
    RUN_FROM,
    SHORT,
)

AT_ONCE = 4096
"""Number of samples interpolated at once, to limit memory."""
_64_BITS = (1 << 64) - 1


def add_noise(
    x: NDArray[np.float32],
    key: int,
    first: int,
    scale: float,
    _bits: NDArray[np.uint32],
    _radii: NDArray[np.float32],
    out: NDArray[np.float32],
) -> None:
    """Write `x` plus white Gaussian noise to `out`: the radius is sqrt(−2 ln u), the angle even."""
    n, done = len(x) // 2, 0
    while done < n:
        chunk, offset = divmod(first + done, NOISE_CHUNK)
        m = min(n - done, NOISE_CHUNK - offset)
        keys = _split((key + chunk * 0x9E3779B97F4A7C15) & _64_BITS)
        counters = np.arange(offset, offset + m, dtype=np.uint32)
        u = (_hash(keys & 0xFFFFFFFF, counters) >> 1).astype(np.float64) + 1
        radius = scale * np.sqrt(2 * np.maximum(2.0**-24, 31 * np.log(2) - np.log(u)))
        bits = _hash(keys >> 32, counters)
        angle = (bits.view(np.int32) >> 2) * (2.0**-29 * np.pi / 4)
        is_steep, radius = bits & 1 != 0, np.where(bits & 2 != 0, radius, -radius)
        sin, cos = np.sin(angle), np.cos(angle)
        part = slice(2 * done, 2 * (done + m))
        noise = np.stack((np.where(is_steep, sin, cos), np.where(is_steep, cos, sin)), axis=1)
        out[part] = x[part] + (radius[:, None] * noise).ravel()
        done += m


def _split(z: int) -> int:
    """The hash of splitmix64, from 64 bits to 64."""
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 & _64_BITS
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB & _64_BITS
    return z ^ (z >> 31)


def _hash(key: int, counters: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """32 random bits for each counter: Wellons' triple32 with a key."""
    x = counters ^ np.uint32(key)
    for shift, factor in ((17, 0xED5AD4BB), (11, 0xAC4C1B51), (15, 0x31848BAB)):
        x = (x ^ (x >> np.uint32(shift))) * np.uint32(factor)
    return x ^ (x >> np.uint32(14))


def interpolate(
    parts: NDArray[np.float32],
    filters: NDArray[np.float32],
    start: float,
    step: float,
    out: NDArray[np.complex64],
) -> None:
    """out[n] = x(start + n · step), with the filter of the nearest phase."""
    n_phases, n_taps = len(filters) - 1, filters.shape[1]
    x = np.pad(parts[0] + 1j * parts[1], n_taps).astype(np.complex64)
    for begin in range(0, len(out), AT_ONCE):
        t = start + np.arange(begin, min(begin + AT_ONCE, len(out))) * step
        whole = np.floor(t)
        phase = ((t - whole) * n_phases + 0.5).astype(np.int64)
        at = whole.astype(np.int64) - n_taps // 2 + 1 + n_taps
        inside = (at >= 0) & (at <= len(x) - n_taps)
        windows = sliding_window_view(x, n_taps)[np.where(inside, at, 0)]
        values = np.einsum("nk,nk->n", windows, filters[phase])
        out[begin : begin + len(t)] = np.where(inside, values, 0)


def filter_strided(
    x: NDArray[np.complex64],
    first: int,
    stride: int,
    taps: NDArray[np.float32],
    out: NDArray[np.complex64],
    out_stride: int,
    n: int,
) -> None:
    """out[i · out_stride] = Σ_k taps[2 k] x[first + i · stride + k] for `n` outputs."""
    if n:
        windows = sliding_window_view(x[first:], len(taps) // 2)[::stride][:n]
        out[: (n - 1) * out_stride + 1 : out_stride] = windows @ taps[::2]


def sense(
    x: NDArray[np.complex64],
    threshold: float,
    limit: float,
    patience: float,
    state: NDArray[np.float64],
) -> None:
    """Judge windows: busy with more mean power than `threshold` · floor, else the floor follows.

    Energy without a pause and without a known burst becomes the floor after `patience` samples.
    """
    filled, end = int(state[FILLED]), state[NEXT]
    with np.errstate(over="ignore", invalid="ignore"):
        powers = (x.real**2 + x.imag**2).astype(np.float64)
    powers = np.concatenate((state[POWERS : POWERS + filled], powers))
    n_windows = len(powers) // SENSE_WINDOW
    windows = powers[: n_windows * SENSE_WINDOW].reshape(n_windows, SENSE_WINDOW)
    # A bad sample counts as no power.
    good = windows <= limit**2
    means: NDArray[np.float64] = np.where(good, windows, 0).mean(axis=1)
    whole: NDArray[np.bool_] = np.all(good, axis=1)
    floor, busy_until = float(state[FLOOR]), state[BUSY_UNTIL]
    for number, (power, is_whole) in enumerate(zip(means.tolist(), whole.tolist(), strict=True)):
        if 0 < threshold * floor < power:
            window_at = end - filled + number * SENSE_WINDOW
            if window_at >= busy_until + APART:
                _end_run(busy_until - state[RUN_FROM], state)
                state[RUN_FROM] = window_at
            busy_until = window_at + SENSE_WINDOW
            if busy_until - state[RUN_FROM] > MOST_PULSE:
                state[CARRIER_UNTIL] = busy_until
            if busy_until - max(state[RUN_FROM], state[EXPLAINED_UNTIL]) > patience:
                floor = power
        elif is_whole and (floor == 0 or power < floor / 2):
            floor = max(power, LEAST_FLOOR)
        elif is_whole:
            floor += (power - floor) / 64
    rest = powers[n_windows * SENSE_WINDOW :]
    state[FLOOR], state[BUSY_UNTIL], state[NEXT] = floor, busy_until, end + len(x)
    state[FILLED] = len(rest)
    state[POWERS : POWERS + len(rest)] = rest


def _end_run(length: float, state: NDArray[np.float64]) -> None:
    """Note where a run of busy windows began that was as long as a pulse."""
    if LEAST_PULSE <= length <= MOST_PULSE:
        state[SHORT + int(state[N_SHORT]) % MOST_SHORT] = state[RUN_FROM]
        state[N_SHORT] += 1


def sanitise(x: NDArray[np.complex64], limit: float) -> int:
    """Set samples that are not finite or exceed `limit` to 0; returns their number."""
    good = (np.abs(x.real) < limit) & (np.abs(x.imag) < limit)
    x[~good] = 0
    return int(len(x) - good.sum())


KERNELS: dict[str, Callable[..., float | None]] = {
    "add_noise": add_noise,
    "blank": blank,
    "filter_strided": filter_strided,
    "cut_lines": cut_lines,
    "find_lines": find_lines,
    "find_pulses": find_pulses,
    "interpolate": interpolate,
    "sanitise": sanitise,
    "sense": sense,
}
