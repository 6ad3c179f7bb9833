"""Tables and working memory of the notch; see `phy.kernels.notch`."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.sizes import N_LANES
from phy.tables.block import ArgumentBlock, block_of
from phy.tables.burst import Planes, Row

SIZE = 512
"""Samples of a window, and bins of its spectrum."""
STRIDE = SIZE // 2
"""Samples from one window to the next. Each sample is in two windows."""
SEED_DB = 22.0
"""A bin this far above the median of its window is a line. Echoes do not lift a burst so far."""
LINE_DB = 14.0
"""So is one this far above it, if one close to it is a line, or was in the window before."""
CLOSE = 8
"""Bins that lines may be apart to count as close."""
DC_BACK = 32
"""DC is left in windows if there was no line in so many. Else a line near DC would go and come."""
MOST_CUT = 3 * SIZE // 8
"""Where more bins than these would be cut, nothing is: what is left would be no signal."""


@block_of("f4[1] f4[1] f4[2] f4[2] f4[2] f4[1] f4[1] f4[2] u1[1] i8[1]")
class NotchMemory(NamedTuple):
    """What the notch keeps from call to call, and its working memory."""

    window: Row
    """Root of a Hann window `[SIZE]`; it is applied before the FFT and after its inverse."""
    weights: Row
    """The Hann window, each value twice, of sum 1 `[2 SIZE]`."""
    constant: Planes
    """Spectrum of the root: what a constant of 1 looks like `[2, SIZE]`."""
    twiddles: Planes
    """exp(−2πj m / SIZE) `[2, SIZE]`."""
    planes: NDArray[np.float32]
    """Eight windows, twice `[4, 8 SIZE]`."""
    power: Row
    """Power of each bin of one window `[SIZE]`."""
    square: Row
    """Eight by eight values to transpose."""
    tail: Planes
    """Second half of the last window, as it was left `[2, STRIDE]`."""
    held: NDArray[np.uint8]
    """1 for bins that were cut in the last window `[SIZE]`."""
    quiet: NDArray[np.int64]
    """Number of windows since the last one with lines `[1]`."""


def new_notch_memory() -> ArgumentBlock[NotchMemory]:
    """Memory of a notch, with silence before it."""
    m = np.arange(SIZE)
    root = np.sin(np.pi * (m + 0.5) / SIZE)
    spectrum = np.fft.fft(root)
    circle = np.exp(-2j * np.pi * m / SIZE)
    return ArgumentBlock(
        NotchMemory(
            window=root.astype(np.float32),
            weights=np.repeat(root**2 * (2 / SIZE), 2).astype(np.float32),
            constant=np.stack((spectrum.real, spectrum.imag)).astype(np.float32),
            twiddles=np.stack((circle.real, circle.imag)).astype(np.float32),
            planes=np.empty((4, N_LANES * SIZE), np.float32),
            power=np.empty(SIZE, np.float32),
            square=np.empty(N_LANES * N_LANES, np.float32),
            tail=np.zeros((2, STRIDE), np.float32),
            held=np.zeros(SIZE, np.uint8),
            quiet=np.full(1, DC_BACK),
        )
    )
