"""Transmitter: turns PDUs into a burst's samples, in the order of "What is sent"."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from phy import preamble
from phy.constellation import Modulation
from phy.crc import with_crc32
from phy.header import N_NETWORKS, BurstHeader, n_symbols
from phy.layout import layout
from phy.mcs import HEADER_MCS, MCS_TABLE
from phy.numerology import OFDM_64_16, Numerology
from phy.reference.header import header_bits
from phy.reference.ldpc import encode_blocks
from phy.reference.mapping import to_subcarriers
from phy.reference.ofdm import Samples, to_samples
from phy.sequences import PADDING, whitening

RISE, FALL = 8, 3
"""Number of samples of a burst's rise and fall; no FFT window covers the fall."""
MAX_BOOST_DB = 3.0


class Transmitter:
    """Makes bursts of one network on one grid; has the same interface as `phy.Transmitter`.

    The preamble is stronger than the rest by `preamble_boost_db`. Raises ValueError for an
    impossible network or boost.
    """

    def __init__(
        self, network: int = 0, grid: Numerology = OFDM_64_16, preamble_boost_db: float = 0.0
    ) -> None:
        if not 0 <= network < N_NETWORKS:
            raise ValueError(f"network: got {network}; allowed: 0 to {N_NETWORKS - 1}")
        if not 0 <= preamble_boost_db <= MAX_BOOST_DB:
            raise ValueError(
                f"preamble boost: got {preamble_boost_db} dB; allowed: 0 to {MAX_BOOST_DB:g}"
            )
        self._network = network
        self._grid = grid
        self._boost = 10 ** (preamble_boost_db / 20)

    def modulate(self, pdus: Sequence[bytes], mcs: int) -> NDArray[np.complex64]:
        """Make the burst of 1 to 63 PDUs of one size `[n_samples]`, at mean power 1.

        Raises ValueError for an MCS, a number or a size of PDUs that no header can express.
        """
        grid = self._grid
        sizes = sorted({len(pdu) for pdu in pdus})
        plan = layout(grid, mcs, len(pdus), sizes[-1] if sizes else 0)
        if len(sizes) > 1:
            raise ValueError(f"bytes of a PDU: got {sizes}; allowed: one size in a burst")
        # 3. Block: each PDU with its CRC-32, whitened through the burst.
        blocks = np.frombuffer(b"".join(map(with_crc32, pdus)), np.uint8)
        white = np.unpackbits(blocks ^ whitening(len(blocks))).reshape(plan.n_pdus, -1)
        # 4. Code; the last symbol is filled up.
        coded = encode_blocks(white, plan.form).reshape(-1)
        coded = np.concatenate((coded, PADDING[: plan.n_symbols * plan.symbol_bits - len(coded)]))
        # 5. and 6. Symbols, OFDM.
        subcarriers = to_subcarriers(coded, plan.mcs.modulation, grid, n_symbols(grid))
        payload = to_samples(subcarriers, grid, plan.mcs.peak)
        told = BurstHeader(mcs, plan.n_pdus, plan.pdu_bytes, self._network)
        start = self._boost * preamble.preamble(grid)
        burst = np.concatenate((start, header_samples(told, grid), payload))
        burst[:RISE] *= ramp(RISE)
        burst[-FALL:] *= ramp(FALL)[::-1]
        return burst.astype(np.complex64)


def header_samples(told: BurstHeader, grid: Numerology) -> Samples:
    """The header as BPSK symbols, its peaks clipped as its MCS says `[n · n_symbol]`."""
    coded = header_bits(told, n_symbols(grid) * grid.n_data)
    subcarriers = to_subcarriers(coded, Modulation.BPSK, grid, 0)
    return to_samples(subcarriers, grid, MCS_TABLE[HEADER_MCS].peak)


def ramp(n: int) -> NDArray[np.float64]:
    """A smooth ramp of `n` samples from 0 to 1: sin² of 0 to π/2."""
    rise: NDArray[np.float64] = np.sin(np.pi / 2 * (np.arange(n) + 0.5) / n) ** 2
    return rise
