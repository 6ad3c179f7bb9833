"""Payload: tracks the symbols of a burst and the PDUs in them."""

import math

import numpy as np
from numpy.typing import NDArray

from phy.crc import checked
from phy.cuts import Cuts
from phy.layout import BurstLayout
from phy.numerology import Numerology
from phy.quality import snr_of_llrs
from phy.reference.acquisition import Acquired
from phy.reference.ldpc import decode_blocks
from phy.reference.ofdm import Subcarriers, to_subcarriers
from phy.sequences import whitening

SLIP_EVERY = 256
"""Interval in symbols at which the FFT windows are aligned to the sender's clock."""
SEEMING = 5e-6
"""Squared turn in rad² that phase noise and clocks make still echoes seem to have in a symbol."""
LOUD = 2.0
"""A symbol with so many times the burst's power has another burst in it."""
MOST_ODD = 2
"""So many symbols at the end of a burst may be of another one before the search looks there."""
BACK = 511
"""A good PDU may outlive the begin of another burst in so many of its last samples."""
FADED = 0.25
"""A burst is gone if a PDU fails with less than this share of the burst's power above noise."""


class Payload:
    """Takes the symbols of a burst's payload, and decodes each PDU after its last one."""

    def __init__(
        self, acquired: Acquired, plan: BurstLayout, grid: Numerology, n_header: int, dc: complex
    ) -> None:
        self.acquired = acquired
        self.plan = plan
        self.n_symbols_in = self.n_good = self.n_bad = 0
        self._grid = grid
        self._n_header = n_header
        # What the search takes for DC from now on may be of another burst.
        self._dc = dc
        self._window = acquired.window
        self._llr = np.zeros(0, np.int16)
        self._powers: list[float] = []
        self._hidden = np.zeros(0)
        self.snr_db = acquired.quality.snr_db
        """SNR of the LLRs of the last PDU."""
        self.judged = acquired.window
        channel = acquired.equaliser.channel
        self._level = channel.gain + channel.no

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

    @property
    def need(self) -> int:
        """The index that the stream must reach before the next PDU is in, or the windows slip."""
        return self.end_of(self._next)

    @property
    def _next(self) -> int:
        first = self.n_symbols_in
        limit = first - first % SLIP_EVERY + SLIP_EVERY
        return min(self.plan.symbols_through(self.n_done + 1), limit)

    def take(
        self, stream: NDArray[np.complex64], start: int, cuts: Cuts | None = None
    ) -> Subcarriers:
        """Process the symbols up to `need` of a stream from index `start` on; returns points."""
        found, grid, first = self.acquired, self._grid, self.n_symbols_in
        windows = self.window(first) + grid.n_symbol * np.arange(self._next - first)
        origin = self.window(first) - found.origin
        x = stream[self.window(first) - start : self.need - start]
        y = to_subcarriers(x, windows - windows[0], found.frequency, self._dc, grid, origin)
        self._powers += np.mean(np.abs(y) ** 2, axis=1).tolist()
        kept = whole = None
        if cuts is not None:
            kept = cuts.kept(windows, found.frequency, grid)
            whole = cuts.whole(windows, grid)
        llr, points = found.equaliser.equalise(
            y, self._n_header + first, self.plan.mcs.modulation, kept, whole
        )
        # Bits on a subcarrier, without interference and with it.
        snr = found.equaliser.channel.gain / found.equaliser.channel.no * grid.n_used / grid.n_fft
        share = 1.0 if kept is None else kept.mean(axis=1)
        left = share * np.log2(1 + snr * np.array(found.equaliser.trust))
        self._hidden = np.log2(1 + snr) - left
        self._llr = np.concatenate((self._llr, llr))
        self.n_symbols_in += len(windows)
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

    def count(self) -> tuple[bytes | None, bool, int]:
        """Decode the PDU that is in, and count it.

        Returns the PDU, if its CRC-32 is right; whether the power of a burst was lacking; and the
        index before which nothing tells of another burst in it.
        """
        channel, powers = self.acquired.equaliser.channel, np.array(self._powers)
        data = self.decode()
        end = plain_until = self.end_of(self.n_symbols_in)
        is_last = self.n_done == self.plan.n_pdus
        loud = np.flatnonzero(powers > LOUD * self._level)
        if len(loud):
            plain_until = self.end_of(self.n_symbols_in - len(powers) + int(loud[0]) - 1)
        if is_last and channel.n_odd > MOST_ODD:
            plain_until = min(plain_until, end - BACK)
        lacks_power = len(powers) > 0 and bool(powers.mean() < channel.no + FADED * channel.gain)
        if len(self._hidden):
            told = self.acquired.quality.snr_db
            self.snr_db = snr_of_llrs(told, float(self._hidden.mean()))
        self._powers, self._hidden = [], np.zeros(0)
        self.judged = end
        return data, lacks_power and not is_last, plain_until

    def slip(self) -> None:
        """Align the windows to the sender's clock every 256 symbols, by the slope over subcarriers.

        early = s · 64 / 2π samples, to the nearest
        """
        if self.n_symbols_in % SLIP_EVERY == 0:
            tracking = self.acquired.equaliser.tracking
            early = round(tracking.slope.value * self._grid.n_fft / (2 * math.pi))
            self._window -= early
            tracking.slip(early)
