"""What an excisor has cut out of a stream, as its receiver wants to know it."""

import numpy as np
from numpy.typing import NDArray

from phy.numerology import Numerology
from phy.tables.notch import SIZE, STRIDE

MOST_LOST = 0.2
"""A subcarrier that has lost more than this share of its energy is not relied on."""
# Masks are kept for the longest wait of a receiver: a PDU of the largest size at the lowest rate.
_KEPT = 4096


class Cuts:
    """What the excisor has cut, by number of the window: window n begins at n STRIDE."""

    def __init__(self) -> None:
        self._masks: dict[int, NDArray[np.uint8]] = {}

    def add(self, window: int, mask: NDArray[np.uint8]) -> None:
        """Note that the bins in `mask` `[SIZE]` were cut."""
        self._masks[window] = mask
        while len(self._masks) > _KEPT:
            del self._masks[next(iter(self._masks))]

    def kept(
        self, starts: NDArray[np.int64], frequency: float, grid: Numerology
    ) -> NDArray[np.float32] | None:
        """1 for each subcarrier that FFT windows at absolute `starts` hold whole, else 0.

        The shape is `[n, n_used]`; None: nothing was cut. `frequency` is the sender's offset in
        cycles per sample.
        """
        if not self._masks or next(reversed(self._masks)) < starts[0] // STRIDE - 1:
            return None
        rows = np.ones((len(starts), grid.n_used), np.float32)
        # Most symbols beside a line have lost the same.
        known: dict[bytes, NDArray[np.bool_]] = {}
        for row, start in zip(rows, starts.tolist(), strict=True):
            # A sample is in the window that begins in its stride, and in the one before.
            span = range(start // STRIDE - 1, (start + grid.n_fft - 1) // STRIDE + 1)
            masks = [self._masks[each] for each in span if each in self._masks]
            if masks:
                mask = np.maximum.reduce(masks)
                key = mask.tobytes()
                if key not in known:
                    known[key] = _lost(mask, frequency, grid) < MOST_LOST
                row[:] = known[key]
        return rows if known else None


def _lost(mask: NDArray[np.uint8], frequency: float, grid: Numerology) -> NDArray[np.float64]:
    """Share of the energy of each subcarrier in use that lies in the bins of `mask`."""
    bins = np.flatnonzero(mask) / SIZE
    apart = bins - grid.used[:, None] / grid.n_fft - frequency
    apart -= np.round(apart)
    return np.asarray((np.sinc(apart * grid.n_fft) ** 2).sum(1) * grid.n_fft / SIZE)
