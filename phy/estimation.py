"""A burst's channel, and the tables used to estimate it.

Window convention: every FFT window begins BACKOFF samples before the first echo, so that slightly
earlier echoes stay inside the prefix. The channel estimate includes the resulting slope.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from phy.constellation import Modulation
from phy.numerology import Numerology
from phy.sequences import POLARITY
from phy.sizes import N_LANES, SLIP_EVERY, whole_lanes
from phy.tables.block import ArgumentBlock
from phy.tables.burst import N_FIGURES, Channel, Scratch, Tones

# Groups of the smoother, by the distance of their echoes from the mean delay in samples. One more
# group, made in _basis, holds the echoes farther away, up to a prefix.
_GROUPS = ((0,), (1,), (2, 3), (4, 5, 6, 7, 8))


def new_channel(grid: Numerology) -> ArgumentBlock[Channel]:
    """Memory for a channel that is not estimated yet."""
    n_groups, width = len(tones(grid).content.ends) + 1, whole_lanes(grid.n_used)
    h, speed, centre, turns, inverse, sums = np.zeros((6, 2, width), np.float32)
    return ArgumentBlock(
        Channel(
            h=h,
            speed=speed,
            centre=centre,
            turns=turns,
            inverse=inverse,
            certainty=np.zeros(width, np.float32),
            sums=sums,
            masses=np.zeros(width, np.float32),
            unknown=np.zeros((3, n_groups)),
            power=np.zeros(n_groups),
            figures=np.zeros(N_FIGURES),
            tracking=np.zeros((2, 5)),
            missed=np.zeros((2, len(tones(grid).content.pilots))),
            kept=np.ones((SLIP_EVERY, width), np.float32),
            whole=np.ones(SLIP_EVERY, np.float32),
            trust=np.ones(SLIP_EVERY, np.float32),
        )
    )


def new_scratch(grid: Numerology) -> ArgumentBlock[Scratch]:
    """Working memory of the receiver's kernels on one grid; one per thread."""
    table, width = tones(grid).content, whole_lanes(grid.n_used)
    n_bits, n_groups = max(each.bits for each in Modulation), len(table.ends) + 1
    return ArgumentBlock(
        Scratch(
            windows=np.empty((4, N_LANES * grid.n_fft), np.float32),
            starts=np.empty(N_LANES, np.int64),
            turn=np.empty((2, grid.n_fft), np.float32),
            square=np.empty(N_LANES * N_LANES, np.float32),
            y=np.empty((N_LANES, 2, width), np.float32),
            level=np.empty((2, width), np.float32),
            llr=np.empty(n_bits * grid.n_data, np.float32),
            planes=np.empty(n_bits * grid.n_data, np.int16),
            turned=np.empty(len(table.pilots), np.complex128),
            pilot_power=np.empty(len(table.pilots)),
            rest=np.empty((2, width), np.float32),
            joined=np.empty((2, width), np.float32),
            coefficients=np.empty((2, len(table.basis)), np.float32),
            energies=np.empty(n_groups),
            weights=np.empty((2, n_groups)),
        )
    )


def in_planes(y: NDArray[np.complex64]) -> NDArray[np.float32]:
    """Tones `[n, n_used]` in the kernels' format, with separate real and imaginary parts.

    The result is `[n, 2, width]`.
    """
    n, n_used = y.shape
    out = np.zeros((n, 2, whole_lanes(n_used)), np.float32)
    out[:, 0, :n_used], out[:, 1, :n_used] = y.real, y.imag
    return out


@cache
def tones(grid: Numerology) -> ArgumentBlock[Tones]:
    """The tables of a grid and its subcarriers, computed once."""
    subcarriers = grid.used[grid.tones]
    basis, ends = _basis(subcarriers, grid)
    position = {int(k): i for i, k in enumerate(subcarriers)}
    pairs = [(i, position[k + 1]) for k, i in position.items() if k + 1 in position]
    numbers = np.zeros(whole_lanes(grid.n_used), np.float32)
    numbers[: grid.n_used] = subcarriers
    circle = np.exp(-2j * np.pi * np.arange(grid.n_fft) / grid.n_fft)
    return ArgumentBlock(
        Tones(
            n_fft=grid.n_fft,
            n_symbol=grid.n_symbol,
            gain=1 / grid.scale,
            n_data=grid.n_data,
            bins=subcarriers % grid.n_fft,
            subcarriers=subcarriers,
            numbers=numbers,
            pilots=grid.pilot_values,
            polarity=POLARITY,
            basis=basis,
            ends=ends,
            neighbors=np.array(pairs, np.int64).T.copy(),
            twiddles=np.stack((circle.real, circle.imag)).astype(np.float32),
        )
    )


def _basis(
    subcarriers: NDArray[np.int64], grid: Numerology
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """The smoother's orthonormal rows `[n, width]` in groups, and the end of each group."""
    rows: list[NDArray[np.float64]] = []
    ends = []
    outermost = tuple(range(_GROUPS[-1][-1] + 1, grid.n_cp + 1))
    for group in filter(None, (*_GROUPS, outermost)):
        for delay in group:
            angle = 2 * np.pi * delay * subcarriers / grid.n_fft
            rows += [np.cos(angle), np.sin(angle)] if delay else [np.ones(len(subcarriers))]
        ends.append(len(rows))
    # QR keeps the order: each group's rows are orthogonal to all groups nearer to the mean delay.
    orthonormal, _ = np.linalg.qr(np.array(rows).T)
    out = np.zeros((len(rows), whole_lanes(grid.n_used)), np.float32)
    out[:, : grid.n_used] = orthonormal.T
    return out, np.array(ends, np.int64)
