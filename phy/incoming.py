"""A burst while it is being received."""

import math
from dataclasses import dataclass

from phy.acquisition import Acquired
from phy.demodulation import PduDecoder
from phy.estimation import tones
from phy.kernels.demodulator import slip
from phy.kernels.tracking import SLOPE
from phy.numerology import Numerology


@dataclass(slots=True)
class IncomingBurst:
    """Where its symbols are, and what has become of its PDUs so far."""

    acquired: Acquired
    decoder: PduDecoder
    n_symbol: int
    n_symbols_in: int = 0
    n_good: int = 0
    n_bad: int = 0
    slipped: int = 0

    def window(self, symbol: int) -> int:
        """Absolute index at which the FFT of a payload symbol begins."""
        return self.acquired.window + symbol * self.n_symbol + self.slipped

    def slip(self, grid: Numerology) -> None:
        """Follow the sender's clock by whole samples, as the slope over carriers tells."""
        channel = self.acquired.channel
        slope = float(channel.content.tracking[SLOPE, 0])
        early = round(slope * grid.n_fft / (2 * math.pi))
        if early:
            self.slipped -= early
            slip(early, tones(grid).words, channel.words)
