"""A burst's channel, and the tables with which it is learned.

Window convention: every FFT window begins BACKOFF samples before the first echo, so that echoes a
little earlier than it stay inside the prefix; the channel estimate holds the resulting slope.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from phy.kernels.burst import N_FIGURES, Channel, Tones
from phy.numerology import Numerology

# Groups of the smoother, by how many samples their echoes are from the mean delay; beyond, up to a
# prefix, the last.
_GROUPS = ((0,), (1,), (2, 3), (4, 5, 6, 7, 8))


def new_channel(grid: Numerology) -> Channel:
    """Room for a channel of which nothing is known."""
    n_groups = len(tones(grid).ends) + 1
    return Channel(
        h_hat=np.zeros(grid.n_used, np.complex64),
        unknown=np.zeros(n_groups),
        power=np.zeros(n_groups),
        sums=np.zeros((2, grid.n_used), np.float32),
        masses=np.zeros(grid.n_used, np.float32),
        figures=np.zeros(N_FIGURES),
        tracking=np.zeros((2, 5)),
    )


@cache
def tones(grid: Numerology) -> Tones:
    """The tables of a grid's carriers."""
    carriers = grid.used[grid.tones]
    basis, ends = _basis(carriers, grid)
    position = {int(k): i for i, k in enumerate(carriers)}
    pairs = [(i, position[k + 1]) for k, i in position.items() if k + 1 in position]
    return Tones(
        carriers % grid.n_fft,
        carriers,
        grid.n_data,
        grid.pilot_values,
        basis,
        ends,
        np.array(pairs, np.int64).T.copy(),
    )


def _basis(
    carriers: NDArray[np.int64], grid: Numerology
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Orthonormal rows `[n, n_used]` in groups, and where each group ends."""
    rows: list[NDArray[np.float64]] = []
    ends = []
    outermost = tuple(range(_GROUPS[-1][-1] + 1, grid.n_cp + 1))
    for group in filter(None, (*_GROUPS, outermost)):
        for delay in group:
            angle = 2 * np.pi * delay * carriers / grid.n_fft
            rows += [np.cos(angle), np.sin(angle)] if delay else [np.ones(len(carriers))]
        ends.append(len(rows))
    orthonormal, _ = np.linalg.qr(np.array(rows).T)
    return np.ascontiguousarray(orthonormal.T, np.float32), np.array(ends, np.int64)
