"""Compares power in windows of 64 samples with a noise floor that follows the quiet windows.

A window's powers are stored and summed when it is full, always in the same order, so that its power
does not depend on how the stream was cut into chunks.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.sizes import SENSE_WINDOW as WINDOW
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

_WEIGHT = 1 / 64


@njit(nogil=True, cache=True, error_model="numpy")
def sense(
    x: NDArray[np.complex64],
    threshold: float,
    limit: float,
    patience: float,
    state: NDArray[np.float64],
) -> None:
    """Process samples `[n]`: a window is busy when its mean power exceeds `threshold` · floor.

    Energy without a pause and without a known burst becomes the floor after `patience` samples. Bad
    samples, which are not finite or exceed `limit`, count as no power.
    """
    powers = state[POWERS:]
    filled = int(state[FILLED])
    at = 0
    while at < x.size:
        n = min(WINDOW - filled, x.size - at)
        part, room = x[at : at + n], powers[filled : filled + n]
        for i in range(n):
            room[i] = part[i].real * part[i].real + part[i].imag * part[i].imag
        at += n
        filled += n
        if filled == WINDOW:
            _judge(powers, threshold, limit * limit, patience, state[NEXT] + at, state)
            filled = 0
    state[FILLED] = filled
    state[NEXT] += x.size


@njit(nogil=True, cache=True, error_model="numpy")
def _judge(
    powers: NDArray[np.float64],
    threshold: float,
    limit: float,
    patience: float,
    end: float,
    state: NDArray[np.float64],
) -> None:
    """Judge a full window that ends at index `end`: mark the channel busy, follow the floor."""
    power = _mean(powers)
    # Also true for NaN. A bad sample makes its window's mean very large or NaN.
    spoilt = not power < limit / WINDOW
    if spoilt:
        spoilt = _without_bad(powers, limit) > 0
        power = _mean(powers)
    floor = state[FLOOR]
    busy = floor > 0 and power > threshold * floor
    if busy:
        _note_energy(end, state)
        if end - max(state[RUN_FROM], state[EXPLAINED_UNTIL]) > patience:
            floor = power
    elif spoilt:
        # The window's power is too low by an unknown amount; too low a floor would make all noise
        # busy.
        return
    elif floor == 0 or power < floor / 2:
        floor = power
    else:
        floor += _WEIGHT * (power - floor)
    state[FLOOR] = max(floor, LEAST_FLOOR)


@njit(nogil=True, cache=True, error_model="numpy")
def _note_energy(end: float, state: NDArray[np.float64]) -> None:
    """Note a busy window that ends at index `end`: its run goes on, or a new one begins."""
    last = state[BUSY_UNTIL]
    if end - WINDOW >= last + APART:
        length = last - state[RUN_FROM]
        if LEAST_PULSE <= length <= MOST_PULSE:
            state[SHORT + int(state[N_SHORT]) % MOST_SHORT] = state[RUN_FROM]
            state[N_SHORT] += 1
        state[RUN_FROM] = end - WINDOW
    state[BUSY_UNTIL] = end
    if end - state[RUN_FROM] > MOST_PULSE:
        state[CARRIER_UNTIL] = end


@njit(nogil=True, cache=True, error_model="numpy")
def _mean(powers: NDArray[np.float64]) -> float:
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for i in range(0, WINDOW, 4):
        a += powers[i]
        b += powers[i + 1]
        c += powers[i + 2]
        d += powers[i + 3]
    return ((a + b) + (c + d)) / WINDOW


@njit(nogil=True, cache=True, error_model="numpy")
def _without_bad(powers: NDArray[np.float64], limit: float) -> int:
    """Set powers that are not finite or exceed `limit` to 0; returns their number."""
    bad = 0
    for i in range(powers.size):
        if not powers[i] <= limit:
            powers[i] = 0
            bad += 1
    return bad
