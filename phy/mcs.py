"""Modulation and coding schemes, one table."""

from dataclasses import dataclass
from fractions import Fraction

from phy.constellation import Modulation

HEADER_MCS = 0


@dataclass(frozen=True)
class Mcs:
    """A modulation and a code rate, with the index that the burst header carries."""

    index: int
    modulation: Modulation
    rate: Fraction

    @property
    def name(self) -> str:
        """The scheme's usual name, such as `QPSK 1/2`."""
        return f"{self.modulation.label} {self.rate}"

    @property
    def peak_db(self) -> float:
        """Largest peak over mean power in dB; the clipping error is smaller than the noise."""
        return _PEAKS_DB[self.modulation]

    @property
    def peak(self) -> float:
        """Largest magnitude of a sample, as a factor of the RMS amplitude."""
        return float(10 ** (self.peak_db / 20))

    @property
    def bits_per_subcarrier(self) -> Fraction:
        """Information bits on one data subcarrier of a symbol."""
        return self.modulation.bits * self.rate


_PEAKS_DB = {
    Modulation.BPSK: 7.0,
    Modulation.QPSK: 7.0,
    Modulation.QAM16: 7.5,
    Modulation.QAM64: 8.0,
    Modulation.QAM256: 10.0,
}

MCS_TABLE = tuple(
    Mcs(index, modulation, rate)
    for index, (modulation, rate) in enumerate(
        (
            (Modulation.BPSK, Fraction(1, 2)),
            (Modulation.QPSK, Fraction(1, 2)),
            (Modulation.QPSK, Fraction(3, 4)),
            (Modulation.QAM16, Fraction(1, 2)),
            (Modulation.QAM16, Fraction(3, 4)),
            (Modulation.QAM64, Fraction(2, 3)),
            (Modulation.QAM64, Fraction(3, 4)),
            (Modulation.QAM64, Fraction(5, 6)),
            (Modulation.QAM256, Fraction(3, 4)),
            (Modulation.QAM256, Fraction(5, 6)),
        )
    )
)
"""Every MCS, by index."""


def _slower(mcs: Mcs) -> int:
    lower = [
        each
        for each in MCS_TABLE
        if each.rate == mcs.rate and each.modulation.bits < mcs.modulation.bits
    ]
    return max(lower, key=lambda each: each.modulation.bits, default=mcs).index


SLOWER_MCS = tuple(map(_slower, MCS_TABLE))
"""By MCS, the one with the same code rate and the next lower modulation, or itself."""
