"""Modulation and coding schemes, one table."""

from dataclasses import dataclass
from fractions import Fraction

from phy.constellation import Modulation
from phy.convolutional import HALF, THREE_QUARTERS, TWO_THIRDS, CodeRate

HEADER_MCS = 0


@dataclass(frozen=True)
class Mcs:
    """A modulation and a code rate, by the number that the burst header carries."""

    index: int
    modulation: Modulation
    code: CodeRate

    @property
    def name(self) -> str:
        """As people say it: `QPSK 1/2`."""
        return f"{self.modulation.label} {self.code.name}"

    @property
    def bits_per_carrier(self) -> Fraction:
        """Information bits on one data carrier."""
        return self.modulation.bits * self.code.rate


MCS_TABLE = tuple(
    Mcs(index, modulation, code)
    for index, (modulation, code) in enumerate(
        (
            (Modulation.BPSK, HALF),
            (Modulation.QPSK, HALF),
            (Modulation.QPSK, THREE_QUARTERS),
            (Modulation.QAM16, HALF),
            (Modulation.QAM16, THREE_QUARTERS),
            (Modulation.QAM64, TWO_THIRDS),
            (Modulation.QAM64, THREE_QUARTERS),
        )
    )
)
"""Every MCS that exists, by index."""
