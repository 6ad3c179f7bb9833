"""What an excisor has cut out of a stream, as its receiver wants to know it."""

import numpy as np
from numpy.typing import NDArray

from phy.numerology import Numerology
from phy.tables.blanking import BLOCK
from phy.tables.notch import SIZE, STRIDE

MOST_LOST = 0.2
"""A subcarrier that has lost more than this share of its energy is not relied on."""
# Masks are kept for the longest wait of a receiver: a PDU of the largest size at the lowest rate.
_KEPT = 4096


class Cuts:
    """What the excisor has cut and blanked, as far as the receiver may still ask for it."""

    def __init__(self) -> None:
        # By number of the window: window n begins at n STRIDE.
        self._masks: dict[int, NDArray[np.uint8]] = {}
        # A bit for each sample, by number of the block: block n begins at n BLOCK.
        self._blanked: dict[int, int] = {}

    def add(self, window: int, mask: NDArray[np.uint8]) -> None:
        """Note that the bins in `mask` `[SIZE]` were cut."""
        self._masks[window] = mask
        while len(self._masks) > _KEPT:
            del self._masks[next(iter(self._masks))]

    def blank(self, block: int, samples: NDArray[np.bool_]) -> None:
        """Note that these samples `[BLOCK]` of a block were set to 0."""
        bits = np.packbits(samples, bitorder="little").tobytes()
        self._blanked[block] = int.from_bytes(bits, "little")
        while len(self._blanked) > _KEPT:
            del self._blanked[next(iter(self._blanked))]

    def whole(self, starts: NDArray[np.int64], grid: Numerology) -> NDArray[np.float32] | None:
        """Share of the samples of FFT windows at absolute `starts` `[n]` that were not blanked.

        It is at least one sample. None: all are whole.
        """
        if not self._blanked or next(reversed(self._blanked)) < starts[0] // BLOCK:
            return None
        shares = np.ones(len(starts), np.float32)
        for i, start in enumerate(starts.tolist()):
            first, last = start // BLOCK, (start + grid.n_fft - 1) // BLOCK
            bits = 0
            for block in range(last, first - 1, -1):
                bits = bits << BLOCK | self._blanked.get(block, 0)
            lost = (bits >> start % BLOCK & (1 << grid.n_fft) - 1).bit_count()
            shares[i] = max(1, grid.n_fft - lost) / grid.n_fft
        return shares

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
