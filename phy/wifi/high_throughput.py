"""The HT-SIG field, which identifies 802.11n frames (IEEE 802.11-2020, 19.3.9.4.3)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy.convolutional import HALF, MAX_LLR, N_TAIL, ViterbiWorkspace, decode
from phy.interleaver import order

HT_SIG_SYMBOLS = 2
_N_DATA = 48
_N_BYTES = 6
_CRC_AT = 34
_SCALE = 64
_CRC_POLYNOMIAL = 0x07


class HtSignal(NamedTuple):
    """Content of HT-SIG: modulation and coding scheme, octets of the PSDU, and the width."""

    mcs: int
    n_bytes: int
    is_40_mhz: bool


def parse_ht_signal(points: NDArray[np.complex64]) -> HtSignal | None:
    """Decode HT-SIG from the equalised points of two symbols `[2, 48]`; None if it is not there.

    HT-SIG is BPSK on the imaginary axis, so nothing else is mistaken for it; a CRC protects it.
    """
    across = points.imag
    if np.any(np.sum(across**2, axis=1) < np.sum(points.real**2, axis=1)):
        return None
    levels = np.clip(np.rint(-_SCALE * across), -MAX_LLR, MAX_LLR).astype(np.int16)
    coded = levels[:, order(_N_DATA, 1)].reshape(-1)
    # The decoder's trellis ends after whole octets, so certain zeros are appended to the tail.
    surely_0 = np.full(2 * N_TAIL, MAX_LLR, np.int16)
    fed = np.concatenate((coded, surely_0))[None, :]
    octets = decode(fed, _N_BYTES, HALF, ViterbiWorkspace(8 * _N_BYTES + N_TAIL))[0]
    bits = np.unpackbits(octets)
    if _crc(bits[:_CRC_AT]) != int(bits[_CRC_AT : _CRC_AT + 8] @ (1 << np.arange(7, -1, -1))):
        return None
    return HtSignal(
        mcs=int(bits[:7] @ (1 << np.arange(7))),
        n_bytes=int(bits[8:24] @ (1 << np.arange(16))),
        is_40_mhz=bool(bits[7]),
    )


def _crc(bits: NDArray[np.uint8]) -> int:
    """CRC-8 of HT-SIG: x^8 + x^2 + x + 1, from all ones, inverted (19.3.9.4.4)."""
    register = 0xFF
    for bit in bits:
        carry = register >> 7 ^ int(bit)
        register = register << 1 & 0xFF
        if carry:
            register ^= _CRC_POLYNOMIAL
    return register ^ 0xFF
