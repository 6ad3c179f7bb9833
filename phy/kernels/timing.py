"""Finds the position and frequency of the long training by correlation with the sent signal."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from phy.kernels.inline import step
from phy.kernels.lanes import Lanes, load, splat, store, total
from phy.kernels.local import local
from phy.sizes import N_LANES
from phy.tables.acquisition import AMBIGUITY, SEARCH
from phy.tables.burst import Planes

# Least share of the samples' power in a match: less is chance, or no preamble.
MIN_MATCH = 0.12
# The first echo counts, not the strongest: windows must begin before it. It has at least this share
# of the strongest one's power, and comes at most MAX_SPREAD samples earlier.
FIRST_ECHO = 0.1
MAX_SPREAD = 12
# Longest template in samples for which two in sequence are added with their phases.
_COHERENT = 64
# Samples from one phase measurement to the next, on every grid.
_LAG = 64


@njit(nogil=True, cache=True, error_model="numpy")
def correlate(planes: Planes, templates: NDArray[np.complex64], out: NDArray[np.float32]) -> None:
    """Write how strongly two consecutive templates match at each offset of `planes` `[2, …]`.

    With c[o] = Σ_m z[o + m] t*[a, m], out[a, o] = |c[o] + c[o + n]|². For long templates the
    frequency is not known well enough to add amplitudes: out[a, o] = 2 |c[o]|² + 2 |c[o + n]|².
    `templates` are `[aliases, n]`; `out` is `[aliases, offsets]` with whole lanes of offsets.
    """
    n, n_out = templates.shape[1], out.shape[1]
    for a in range(templates.shape[0]):
        for o in range(0, n_out, N_LANES):
            re, im = _match(planes, o, templates[a])
            later_re, later_im = _match(planes, o + n, templates[a])
            sum_re, sum_im = re + later_re, im + later_im
            strength = sum_re * sum_re + sum_im * sum_im
            if n > _COHERENT:
                less_re, less_im = re - later_re, im - later_im
                strength = strength + (less_re * less_re + less_im * less_im)
            store(out, a * n_out + o, strength)


@step
def _match(planes: Planes, at: int, template: NDArray[np.complex64]) -> tuple[Lanes, Lanes]:
    """Σ_m z[o + m] t*[m] for the eight offsets from `at` on."""
    size = planes.shape[1]
    re: Lanes = splat(0)
    im: Lanes = splat(0)
    for m in range(template.size):
        a, b = load(planes, at + m), load(planes, size + at + m)
        c, d = splat(template[m].real), splat(template[m].imag)
        re = re + (a * c + b * d)
        im = im + (b * c - a * d)
    return re, im


@njit(nogil=True, cache=True, error_model="numpy")
def locate(planes: Planes, templates: NDArray[np.complex64]) -> tuple[int, float]:
    """(first sample of the long training's first echo or −1, frequency in cycles per sample).

    The search for the first echo covers the first 2 SEARCH samples of `planes` `[2, ≥ 2 SEARCH + 2
    n_fft]`.
    """
    n_aliases, n = templates.shape
    strength = local(np.float32, (n_aliases, 2 * SEARCH))
    correlate(planes, templates, strength)
    alias, peak, strongest = 0, 0, np.float32(-1)
    for a in range(n_aliases):
        for o in range(2 * SEARCH):
            if strength[a, o] > strongest:
                alias, peak, strongest = a, o, strength[a, o]
    size, energy = planes.shape[1], splat(0)
    for m in range(peak, peak + 2 * n, N_LANES):
        a, b = load(planes, m), load(planes, size + m)
        energy = energy + (a * a + b * b)
    if not strongest > MIN_MATCH * 2 * n * total(energy):
        return -1, 0.0
    early = max(0, peak - MAX_SPREAD)
    while strength[alias, early] < FIRST_ECHO * strongest:
        early += 1
    turn, before = 0j, 0j
    for begin in range(0, 2 * n, _LAG):
        seen = 0j
        for m in range(begin, begin + _LAG):
            z = complex(planes[0, peak + m], planes[1, peak + m])
            seen += z * complex(templates[alias, m % n]).conjugate()
        turn += seen * before.conjugate()
        before = seen
    rest = math.atan2(turn.imag, turn.real) / (2 * math.pi * _LAG)
    return early, (alias - n_aliases // 2) * AMBIGUITY + rest
