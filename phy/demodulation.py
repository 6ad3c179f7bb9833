"""Demodulates samples to LLRs, and decodes LLRs to PDUs."""

import numpy as np
from numpy.typing import NDArray

from phy import compute
from phy.constellation import Modulation
from phy.crc import checked
from phy.estimation import new_scratch, tones
from phy.layout import BurstLayout
from phy.ldpc import decode, new_workspace
from phy.mapping import axes
from phy.numerology import Numerology
from phy.sequences import whitening
from phy.tables.block import ArgumentBlock
from phy.tables.burst import Channel

# Initial room for LLRs: about ten PDUs of usual size.
_ROOM = 1 << 14


class Demodulator:
    """Turns samples into LLRs on one grid. Not thread-safe."""

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
        hidden: NDArray[np.float64],
        points: NDArray[np.complex64] | None = None,
    ) -> float:
        """Write the LLRs of OFDM symbols, in the code's order, to `llr` `[n · n_data · bits]`.

        The first symbol's FFT window begins with `samples`. They have rotated by `frequency` cycles
        per sample, starting `origin` samples earlier. The header's first symbol is number 0.
        `channel` is updated. `powers` `[≥ n]` gets each symbol's mean power on a subcarrier;
        `hidden` `[≥ n]` gets the bits on a subcarrier that interference hid, of all symbols up to
        each; `points` `[n, n_data]`, if given, gets the equalised points. Returns the largest
        power.
        """
        grid = self._grid
        n = (len(samples) - grid.n_fft) // grid.n_symbol + 1
        to = self._no_points if points is None else points
        loudest: float = compute.demodulate(
            samples, n, frequency, dc, origin, first_symbol,
            tones(grid), axes(modulation, grid), channel, self._scratch,
            to, llr, powers, hidden,
        )  # fmt: skip
        return loudest


class PduDecoder:
    """Collects a burst's LLRs and decodes each PDU once its symbols are in. One per thread."""

    def __init__(self) -> None:
        self._workspace = new_workspace()
        self._llr = np.empty(_ROOM, np.int16)
        self._n_kept = 0
        self._n_filled = 0
        self._n_decoded = 0

    def start(self, plan: BurstLayout) -> None:
        """Begin a new burst; LLRs of the last one are discarded."""
        self._plan = plan
        self._n_kept = self._n_filled = self._n_decoded = 0

    def room(self, n_symbols: int) -> NDArray[np.int16]:
        """Room for the LLRs of the next `n_symbols` symbols; call `decode` between requests."""
        n = self._n_kept + n_symbols * self._plan.symbol_bits
        if n > len(self._llr):
            larger = np.empty(2 * n, np.int16)
            larger[: self._n_kept] = self._llr[: self._n_kept]
            self._llr = larger
        self._n_filled = n
        return self._llr[self._n_kept : n]

    def decode(self, n_pdus: int) -> list[bytes | None]:
        """Decode the next `n_pdus` PDUs, whose symbols are complete; None for each wrong CRC-32."""
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
