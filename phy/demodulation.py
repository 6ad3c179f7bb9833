"""From samples to LLRs, and from LLRs to PDUs."""

import numpy as np
from numpy.typing import NDArray

from phy.constellation import Modulation
from phy.crc import checked
from phy.estimation import new_scratch, tones
from phy.kernels import demodulator as kernel
from phy.kernels.argument_block import ArgumentBlock
from phy.kernels.burst import Channel
from phy.layout import BurstLayout
from phy.ldpc import decode, new_workspace
from phy.mapping import axes
from phy.numerology import Numerology
from phy.sequences import whitening

# LLRs for which there is room at first: some ten PDUs of usual size.
_ROOM = 1 << 14


class Demodulator:
    """Turns samples into LLRs on one grid. For one thread at a time."""

    def __init__(self, grid: Numerology) -> None:
        self._grid = grid
        self._scratch = new_scratch(grid)
        self._no_points = np.empty((0, grid.n_data), np.complex64)

    def demodulate(
        self,
        samples: NDArray[np.complex64],
        frequency: float,
        dc: complex,
        origin: int,
        modulation: Modulation,
        channel: ArgumentBlock[Channel],
        first_symbol: int,
        llr: NDArray[np.int16],
        powers: NDArray[np.float32],
        points: NDArray[np.complex64] | None = None,
    ) -> None:
        """Write the LLRs of OFDM symbols, in the code's order, to `llr` `[n · n_data · bits]`.

        The first one's FFT window begins with `samples`, which have turned by `frequency` cycles a
        sample since `origin` samples before. The header's first symbol is number 0. `channel` moves
        on. `powers` `[≥ n]` gets the mean power on a subcarrier of each symbol, `points` `[n,
        n_data]` the equalised points, if they are wanted.
        """
        grid = self._grid
        n = (len(samples) - grid.n_fft) // grid.n_symbol + 1
        to = self._no_points if points is None else points
        kernel.demodulate(
            samples, n, frequency, dc, origin, first_symbol,
            tones(grid).packed, axes(modulation, grid).packed, channel.packed, self._scratch.packed,
            to, llr, powers,
        )  # fmt: skip


class PduDecoder:
    """Collects a burst's LLRs and decodes each PDU when its symbols are in. One for each thread."""

    def __init__(self) -> None:
        self._workspace = new_workspace()
        self._llr = np.empty(_ROOM, np.int16)
        self._n_kept = 0
        self._n_filled = 0
        self._n_decoded = 0

    def start(self, plan: BurstLayout) -> None:
        """Begin a new burst; LLRs of the last one are dropped."""
        self._plan = plan
        self._n_kept = self._n_filled = self._n_decoded = 0

    def room(self, n_symbols: int) -> NDArray[np.int16]:
        """Room for the LLRs of the next `n_symbols` symbols; call `decode` before asking anew."""
        n = self._n_kept + n_symbols * self._plan.symbol_bits
        if n > len(self._llr):
            larger = np.empty(2 * n, np.int16)
            larger[: self._n_kept] = self._llr[: self._n_kept]
            self._llr = larger
        self._n_filled = n
        return self._llr[self._n_kept : n]

    def decode(self, n_pdus: int) -> list[bytes | None]:
        """The next `n_pdus` PDUs, whose symbols are all in; None for each whose CRC-32 is wrong."""
        plan = self._plan
        found: list[bytes | None] = []
        size, n_bits = plan.block_bytes, n_pdus * plan.coded_bits
        if n_pdus:
            white = whitening(n_pdus * size, self._n_decoded * size)
            out = decode(self._llr[:n_bits], plan.form, self._workspace, white=white)
            blocks = out.tobytes()
            found = [checked(blocks[at : at + size]) for at in range(0, len(blocks), size)]
            self._n_decoded += n_pdus
        self._n_kept = self._n_filled - n_bits
        if self._n_kept:
            self._llr[: self._n_kept] = self._llr[n_bits : self._n_filled].copy()
        return found
