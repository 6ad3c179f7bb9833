"""PDUs to the samples of one burst."""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from phy import header, ofdm, preamble
from phy.constellation import Modulation
from phy.crc import with_crc32
from phy.header import N_NETWORKS, BurstHeader, header_bits
from phy.layout import layout
from phy.ldpc import encode
from phy.mapping import mapping
from phy.numerology import OFDM_64_16, Numerology
from phy.sequences import PADDING, whitening


class Transmitter:
    """Makes bursts of one network on one grid. Holds tables only: any thread may use it."""

    def __init__(self, network: int = 0, grid: Numerology = OFDM_64_16) -> None:
        if not 0 <= network < N_NETWORKS:
            raise ValueError(f"network: got {network}; allowed: 0 to {N_NETWORKS - 1}")
        self._network = network
        self._grid = grid

    def modulate(self, pdus: Sequence[bytes], mcs: int) -> NDArray[np.complex64]:
        """The burst of 1 to 63 PDUs of equal size `[n_samples]`, at mean power 1.

        Raises ValueError for an MCS, number or size that no header can tell.
        """
        sizes = sorted({len(pdu) for pdu in pdus})
        plan = layout(self._grid, mcs, len(pdus), sizes[-1] if sizes else 0)
        if len(sizes) > 1:
            raise ValueError(f"bytes of a PDU: got {sizes}; allowed: one size in a burst")
        blocks = np.frombuffer(b"".join(map(with_crc32, pdus)), np.uint8)
        white = (blocks ^ whitening(len(blocks))).reshape(plan.n_pdus, plan.block_bytes)
        coded = encode(np.unpackbits(white, axis=1), plan.form).reshape(-1)
        n_padding = plan.n_symbols * plan.symbol_bits - len(coded)
        coded = np.concatenate((coded, PADDING[:n_padding]))
        spectrum = mapping(plan.mcs.modulation, self._grid).to_spectrum(coded, header.N_SYMBOLS)
        told = BurstHeader(mcs, plan.n_pdus, plan.pdu_bytes, self._network)
        return np.concatenate((_opening(told, self._grid), ofdm.to_samples(spectrum, self._grid)))


@lru_cache(maxsize=64)
def _opening(told: BurstHeader, grid: Numerology) -> NDArray[np.complex64]:
    """Preamble and header of a burst; most bursts resemble one before."""
    spectrum = header_spectrum(told, grid)
    return np.concatenate((preamble.preamble(grid), ofdm.to_samples(spectrum, grid)))


def header_spectrum(told: BurstHeader, grid: Numerology) -> NDArray[np.complex64]:
    """FFT bins of the header's symbols `[2, n_fft]`."""
    coded = header_bits(told, header.N_SYMBOLS * grid.n_data)
    return mapping(Modulation.BPSK, grid).to_spectrum(coded, 0)
