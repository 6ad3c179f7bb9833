"""Payload: tracks the symbols of a burst and the PDUs in them."""

import math

import numpy as np
from numpy.typing import NDArray

from phy.crc import checked
from phy.cuts import Cuts
from phy.layout import BurstLayout
from phy.numerology import Numerology
from phy.reference.acquisition import Acquired
from phy.reference.ldpc import decode_blocks
from phy.reference.ofdm import Subcarriers, to_subcarriers
from phy.sequences import whitening

SLIP_EVERY = 256
"""Interval in symbols at which the FFT windows are aligned to the sender's clock."""
SEEMING = 5e-6
"""Squared turn in rad² that phase noise and clocks make still echoes seem to have in a symbol."""
FADED = 0.25
"""A burst is gone if a PDU fails with less than this share of the burst's power above noise."""


class Payload:
    """Takes the symbols of a burst's payload, and decodes each PDU after its last one."""

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
        """Number of PDUs decoded so far, successfully or not."""
        return self.n_good + self.n_bad

    def window(self, symbol: int) -> int:
        """Absolute index at which the FFT of a payload symbol begins."""
        return self._window + symbol * self._grid.n_symbol

    def end_of(self, n: int) -> int:
        """Absolute index after the FFTs of the first `n` symbols."""
        return self.window(n) - self._grid.n_cp

    def n_through(self, end: int) -> int:
        """How many symbols can be taken when the stream reaches index `end`.

        At most those that complete the next PDU, and those before the windows slip.
        """
        plan, first = self.plan, self.n_symbols_in
        arrived = (end - self.end_of(0)) // self._grid.n_symbol
        limit = first - first % SLIP_EVERY + SLIP_EVERY
        return min(arrived, plan.symbols_through(self.n_done + 1), limit) - first

    def take(
        self, samples: NDArray[np.complex64], dc: complex, n: int, cuts: Cuts | None = None
    ) -> Subcarriers:
        """Process the next `n` symbols, from the first FFT window on; returns their points."""
        found, grid, first = self.acquired, self._grid, self.n_symbols_in
        origin = self.window(first) - found.origin
        starts = grid.n_symbol * np.arange(n)
        y = to_subcarriers(samples, starts, found.frequency, dc, grid, origin)
        self._powers += np.mean(np.abs(y) ** 2, axis=1).tolist()
        kept = None
        if cuts is not None:
            kept = cuts.kept(self.window(first) + starts, found.frequency, grid)
        llr, points = found.equaliser.equalise(
            y, self._n_header + first, self.plan.mcs.modulation, kept
        )
        self._llr = np.concatenate((self._llr, llr))
        self.n_symbols_in += n
        return points

    def is_next_in(self) -> bool:
        """Whether all symbols of the next PDU have arrived."""
        plan = self.plan
        return self.n_done < plan.n_pdus and len(self._llr) >= plan.coded_bits

    def decode(self) -> bytes | None:
        """Decode the next PDU; None if its CRC-32 is wrong."""
        plan, size = self.plan, self.plan.block_bytes
        bits = decode_blocks(self._llr[: plan.coded_bits], plan.form)
        block = np.packbits(bits) ^ whitening(size, self.n_done * size)
        data = checked(block.tobytes())
        self._llr = self._llr[plan.coded_bits :]
        self.n_good += data is not None
        self.n_bad += data is None
        return data

    @property
    def doppler(self) -> float:
        """Doppler of the echoes so far, in cycles per sample: their mean turn, beyond SEEMING."""
        channel = self.acquired.equaliser.channel
        turns = channel.turns / max(1, channel.n_followed) - SEEMING
        return math.sqrt(max(0.0, turns)) / (2 * math.pi * self._grid.n_symbol)

    def is_gone(self) -> bool:
        """Whether the symbols since the last PDU lacked the power of a burst."""
        channel = self.acquired.equaliser.channel
        powers = self._powers
        return bool(powers) and float(np.mean(powers)) < channel.no + FADED * channel.gain

    def count_powers_anew(self) -> None:
        """Start to measure the power of symbols for the next PDU."""
        self._powers = []

    def slip(self) -> None:
        """Align the windows to the sender's clock every 256 symbols, by the slope over subcarriers.

        early = s · 64 / 2π samples, to the nearest
        """
        if self.n_symbols_in % SLIP_EVERY == 0:
            tracking = self.acquired.equaliser.tracking
            early = round(tracking.slope.value * self._grid.n_fft / (2 * math.pi))
            self._window -= early
            tracking.slip(early)
