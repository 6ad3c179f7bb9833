"""The payload of a burst keeps count of its symbols and of the PDUs in them."""

import math

import numpy as np
from numpy.typing import NDArray

from phy.crc import checked
from phy.layout import BurstLayout
from phy.numerology import Numerology
from phy.reference.acquisition import Acquired
from phy.reference.ldpc import decode_blocks
from phy.reference.ofdm import to_subcarriers
from phy.sequences import whitening

SLIP_EVERY = 256
"""After so many symbols, the FFT windows follow the sender's clock by whole samples."""
FADED = 0.25
"""A burst is gone when a PDU fails with less than this share of its power above the noise."""


class Payload:
    """A payload is taken in symbol by symbol, and each PDU decoded when its last symbol is in."""

    def __init__(
        self, acquired: Acquired, plan: BurstLayout, grid: Numerology, n_header: int
    ) -> None:
        self.acquired = acquired
        self.plan = plan
        self.n_symbols_in = self.n_good = self.n_bad = 0
        self._grid = grid
        self._n_header = n_header
        self._window = acquired.window
        self._llr = np.zeros(0, np.int16)
        self._powers: list[float] = []

    @property
    def n_done(self) -> int:
        """This many PDUs were decoded, well or badly."""
        return self.n_good + self.n_bad

    def window(self, symbol: int) -> int:
        """The FFT of a payload symbol begins at this absolute index."""
        return self._window + symbol * self._grid.n_symbol

    def end_of(self, n: int) -> int:
        """The FFTs of the first `n` symbols end before this absolute index."""
        return self.window(n) - self._grid.n_cp

    def take(self, samples: NDArray[np.complex64], dc: complex) -> NDArray[np.complex128]:
        """The method takes in the next symbol's FFT window `[n_fft]`, and returns its points."""
        found, grid, number = self.acquired, self._grid, self.n_symbols_in
        origin = self.window(number) - found.origin
        y = to_subcarriers(samples, np.array([0]), found.frequency, dc, grid, origin)[0]
        self._powers.append(float(np.mean(np.abs(y) ** 2)))
        llr, points = found.equaliser.equalise(y, self._n_header + number, self.plan.mcs.modulation)
        self._llr = np.concatenate((self._llr, llr))
        self.n_symbols_in += 1
        return points

    def is_next_in(self) -> bool:
        """The answer is True when the symbols of the next PDU are all in."""
        plan = self.plan
        return self.n_done < plan.n_pdus and len(self._llr) >= plan.coded_bits

    def decode(self) -> bytes | None:
        """The method returns the next PDU, or None when its CRC-32 is wrong."""
        plan, size = self.plan, self.plan.block_bytes
        bits = decode_blocks(self._llr[: plan.coded_bits], plan.form)
        block = np.packbits(bits) ^ whitening(size, self.n_done * size)
        data = checked(block.tobytes())
        self._llr = self._llr[plan.coded_bits :]
        self.n_good += data is not None
        self.n_bad += data is None
        return data

    def is_gone(self) -> bool:
        """The answer is True when the symbols since the last PDU had no power of a burst."""
        channel = self.acquired.equaliser.channel
        powers = self._powers
        return bool(powers) and float(np.mean(powers)) < channel.no + FADED * channel.gain

    def count_powers_anew(self) -> None:
        """The powers of symbols count from here on for the next PDU."""
        self._powers = []

    def slip(self) -> None:
        """Every 256 symbols, windows follow the sender's clock, as the slope over subcarriers
        tells.

        early = s · 64 / 2π samples, to the nearest
        """
        if self.n_symbols_in % SLIP_EVERY == 0:
            tracking = self.acquired.equaliser.tracking
            early = round(tracking.slope.value * self._grid.n_fft / (2 * math.pi))
            self._window -= early
            tracking.slip(early)
