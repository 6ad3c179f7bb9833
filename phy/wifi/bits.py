"""Decodes LLRs to the octets of an 802.11a frame (IEEE 802.11-2020, 17.3.4 and 17.3.5)."""

import zlib
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.constellation import Modulation
from phy.convolutional import (
    HALF,
    MAX_LLR,
    N_TAIL,
    THREE_QUARTERS,
    TWO_THIRDS,
    CodeRate,
    ViterbiWorkspace,
    decode,
)

FCS_SIZE = 4
MAX_PSDU = 4095
_SIGNAL_BITS = 18
_SERVICE_BYTES = 2


class Rate(NamedTuple):
    """One of the eight rates of 802.11a; `mbps` is its speed in Mbit/s at 20 MHz."""

    mbps: int
    modulation: Modulation
    code: CodeRate

    @property
    def name(self) -> str:
        """The rate's modulation and code in the usual form, such as `16QAM 1/2`."""
        return f"{self.modulation.label} {self.code.name}"

    @property
    def data_bits(self) -> int:
        """Information bits of one symbol."""
        return int(48 * self.modulation.bits * self.code.rate)

    def n_symbols(self, n_bytes: int) -> int:
        """Number of symbols for a PSDU of `n_bytes`, with SERVICE and tail."""
        return -(-(8 * (_SERVICE_BYTES + n_bytes) + N_TAIL) // self.data_bits)


RATES = {
    0b1101: Rate(6, Modulation.BPSK, HALF),
    0b1111: Rate(9, Modulation.BPSK, THREE_QUARTERS),
    0b0101: Rate(12, Modulation.QPSK, HALF),
    0b0111: Rate(18, Modulation.QPSK, THREE_QUARTERS),
    0b1001: Rate(24, Modulation.QAM16, HALF),
    0b1011: Rate(36, Modulation.QAM16, THREE_QUARTERS),
    0b0001: Rate(48, Modulation.QAM64, TWO_THIRDS),
    0b0011: Rate(54, Modulation.QAM64, THREE_QUARTERS),
}
"""Rates by the four bits of the SIGNAL field, first bit highest (table 17-6)."""


class Signal(NamedTuple):
    """Content of the SIGNAL field: the rate of what follows, and the octets of the PSDU."""

    rate: Rate
    n_bytes: int


def parse_signal(llr: NDArray[np.int16]) -> Signal | None:
    """Decode the SIGNAL field from its symbol's LLRs `[48]`; None if it is invalid (17.3.4)."""
    # The decoder's trellis ends after whole octets, so certain zeros are appended to the tail.
    surely_0 = np.full(2 * (3 * 8 + N_TAIL) - len(llr), MAX_LLR, np.int16)
    fed = np.concatenate((llr, surely_0))[None, :]
    bits = np.unpackbits(decode(fed, 3, HALF, ViterbiWorkspace(3 * 8 + N_TAIL))[0])
    rate = RATES.get(int(bits[:4] @ (8, 4, 2, 1)))
    n_bytes = int(bits[5:17] @ (1 << np.arange(12)))
    is_even = int(bits[:_SIGNAL_BITS].sum()) % 2 == 0
    if rate is None or bits[4] or not is_even or bits[_SIGNAL_BITS:].any() or not n_bytes:
        return None
    return Signal(rate, n_bytes)


def parse_data(llr: NDArray[np.int16], signal: Signal) -> bytes:
    """The descrambled PSDU from the LLRs of the data symbols."""
    n_bytes = _SERVICE_BYTES + signal.n_bytes
    code = signal.rate.code
    n_coded = code.n_coded(8 * n_bytes)
    workspace = ViterbiWorkspace(8 * n_bytes + N_TAIL)
    bits = np.unpackbits(decode(llr[None, :n_coded], n_bytes, code, workspace)[0])
    plain = bits ^ _scrambling(bits[:7], len(bits))
    return np.packbits(plain, bitorder="little").tobytes()[_SERVICE_BYTES:]


def _scrambling(first: NDArray[np.uint8], n: int) -> NDArray[np.uint8]:
    """`n` bits of the scrambling sequence (x^7 + x^4 + 1) that begins with `first` `[7]`.

    SERVICE begins with seven zeros, so its first seven received bits are those of the sequence.
    """
    out = np.empty(max(n, 127), np.uint8)
    out[:7] = first
    for i in range(7, 127):
        out[i] = out[i - 7] ^ out[i - 4]
    return np.resize(out[:127], n)


def has_right_fcs(psdu: bytes) -> bool:
    """Whether the PSDU's last four octets are the CRC-32 of those before (9.2.4.8)."""
    fcs = int.from_bytes(psdu[-FCS_SIZE:], "little")
    return len(psdu) > FCS_SIZE and zlib.crc32(psdu[:-FCS_SIZE]) == fcs
