"""Symbols to LLRs, and LLRs to PDUs."""

import numpy as np
from numpy.typing import NDArray

from phy.constellation import Modulation
from phy.crc import checked
from phy.estimation import tones
from phy.kernels.burst import Channel
from phy.kernels.equaliser import demap
from phy.layout import BurstLayout
from phy.ldpc import LdpcWorkspace, decode
from phy.mapping import axes
from phy.numerology import Numerology
from phy.sequences import polarity, whitening

# LLRs for which there is room at first: some ten PDUs of usual size.
_ROOM = 1 << 14


class Demodulator:
    """Equaliser and demapper of one modulation on one grid."""

    def __init__(self, modulation: Modulation, grid: Numerology) -> None:
        self._tones = tones(grid)
        self._axes = axes(modulation, grid)
        self._no_points = np.empty((0, grid.n_data), np.complex64)

    def demap(
        self,
        y: NDArray[np.float32],
        channel: Channel,
        first_symbol: int,
        llr: NDArray[np.int16],
        points: NDArray[np.complex64] | None = None,
    ) -> None:
        """LLRs of tones `y` `[n, 2, ≥ n_used]` in the code's order to `llr` `[n · n_data · bits]`.

        `points` `[n, n_data]` gets the equalised points, if they are wanted. `channel` moves on.
        The header's first symbol is number 0.
        """
        white = polarity(len(y), first_symbol)
        to = self._no_points if points is None else points
        demap(y, white, self._tones, self._axes, channel, to, llr)


class PduDecoder:
    """Collects LLRs of a burst and decodes each PDU when its symbols are in."""

    def __init__(self, plan: BurstLayout, workspace: LdpcWorkspace) -> None:
        self.layout = plan
        self._workspace = workspace
        self._llr = np.empty(_ROOM, np.int16)
        self._n_kept = 0
        self._n_filled = 0
        self._n_decoded = 0

    def room(self, n_symbols: int) -> NDArray[np.int16]:
        """Where the LLRs of the next `n_symbols` symbols belong; decode them before the next."""
        n = self._n_kept + n_symbols * self.layout.symbol_bits
        if n > len(self._llr):
            larger = np.empty(2 * n, np.int16)
            larger[: self._n_kept] = self._llr[: self._n_kept]
            self._llr = larger
        self._n_filled = n
        return self._llr[self._n_kept : n]

    def decode(self, n_pdus: int) -> list[bytes | None]:
        """The next `n_pdus` PDUs, whose symbols are all in; None where a check fails."""
        plan = self.layout
        size, n_bits = plan.block_bytes, n_pdus * plan.coded_bits
        blocks = b""
        if n_pdus:
            llr = self._llr[:n_bits].reshape(n_pdus, -1)
            white = decode(llr, plan.form, self._workspace).reshape(-1)
            blocks = (white ^ whitening(len(white), self._n_decoded * size)).tobytes()
            self._n_decoded += n_pdus
        rest = self._llr[n_bits : self._n_filled]
        self._llr[: len(rest)] = rest.copy()
        self._n_kept = len(rest)
        return [checked(blocks[at : at + size]) for at in range(0, len(blocks), size)]
