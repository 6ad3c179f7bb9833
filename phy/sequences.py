"""Shift-register sequences: the whitening of payloads and the polarity of pilots."""

import numpy as np
from numpy.typing import NDArray


def lfsr(taps: tuple[int, ...], state: int, n_bits: int) -> NDArray[np.uint8]:
    """`n_bits` bits of the feedback register with polynomial 1 + Σ x^tap, from `state` ≠ 0 on."""
    degree = max(taps)
    out = np.empty(n_bits, np.uint8)
    for i in range(n_bits):
        bit = 0
        for tap in taps:
            bit ^= state >> (tap - 1) & 1
        state = (state << 1 | bit) & ((1 << degree) - 1)
        out[i] = bit
    return out


_MAX_SYMBOLS = 1 << 17
POLARITY = np.resize(1 - 2 * lfsr((4, 7), 0b1111111, 127).astype(np.float32), _MAX_SYMBOLS)
"""Sign of the pilots of each symbol; the header's first symbol is 0 (802.11, 17.3.5.10)."""


def polarity(n_symbols: int, start: int = 0) -> NDArray[np.float32]:
    """Signs of the pilots of `n_symbols` symbols from symbol `start` on."""
    return POLARITY[start : start + n_symbols]


# x^15 + x^14 + 1 has a period of 32767 bits. 8 does not divide it, so the period in bytes is as
# long.
_N_PERIODS = 4
_WHITE = np.tile(np.packbits(np.tile(lfsr((14, 15), 0x2AAA, 32767), 8)), _N_PERIODS)
PADDING = np.unpackbits(_WHITE[:256])
"""Bits that fill up the last symbol of a burst."""


def whitening(n_bytes: int, start: int = 0) -> NDArray[np.uint8]:
    """The sequence that whitens a burst's bytes from `start` on, by XOR: zeros make no peaks."""
    return _WHITE[start : start + n_bytes]
