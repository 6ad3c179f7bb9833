"""Turns PDUs into the samples of one burst."""

from collections.abc import Sequence
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from phy import header, preamble
from phy.constellation import Modulation
from phy.crc import with_crc32
from phy.header import N_NETWORKS, BurstHeader
from phy.header_code import header_bits
from phy.layout import layout
from phy.ldpc import packed_form
from phy.mapping import mapping
from phy.mcs import HEADER_MCS, MCS_TABLE
from phy.numerology import OFDM_64_16, Numerology
from phy.sequences import whitening
from phy.tables.acquisition import BACKOFF

# Lengths of a burst's rise and fall in samples; the fall lies after the last FFT window.
_RISE, _FALL = 8, BACKOFF
MAX_BOOST_DB = 3.0


class Transmitter:
    """Makes bursts of one network on one grid. It only holds tables, so any thread may use it.

    The preamble has lower peaks than the rest. An amplifier with limited peak power can send it
    stronger, by `preamble_boost_db`, which extends the range at which bursts are found. Receivers
    measure the boost.
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
        """The burst of 1 to 63 PDUs of equal size `[n_samples]`, at mean power 1 without the boost.

        No peak exceeds that of the MCS, or the preamble's 3.2 dB plus its boost. Raises ValueError
        for an MCS, number or size that no header can express.
        """
        sizes = sorted({len(pdu) for pdu in pdus})
        plan = layout(self._grid, mcs, len(pdus), sizes[-1] if sizes else 0)
        if len(sizes) > 1:
            raise ValueError(f"bytes of a PDU: got {sizes}; allowed: one size in a burst")
        blocks = np.frombuffer(b"".join(map(with_crc32, pdus)), np.uint8)
        told = BurstHeader(mcs, plan.n_pdus, plan.pdu_bytes, self._network)
        burst = np.empty(plan.n_samples, np.complex64)
        opening = _opening(told, self._grid, self._boost)
        burst[: len(opening)] = opening
        payload = burst[len(opening) :]
        by, first = mapping(plan.mcs.modulation, self._grid), header.n_symbols(self._grid)
        white = blocks ^ whitening(len(blocks))
        by.modulate(white, plan.n_pdus, packed_form(plan.form), first, plan.mcs.peak, payload)
        payload[-_FALL:] *= _ramp(_FALL)[::-1]
        return burst


@lru_cache(maxsize=64)
def _opening(told: BurstHeader, grid: Numerology, boost: float) -> NDArray[np.complex64]:
    """Preamble and header of a burst; cached because most bursts begin like an earlier one."""
    start = preamble.preamble(grid) * np.float32(boost)
    start[:_RISE] *= _ramp(_RISE)
    return np.concatenate((start, header_samples(told, grid)))


@cache
def _ramp(n: int) -> NDArray[np.float32]:
    """A smooth rise from 0 to 1 `[n]`: the square of a sine."""
    return (np.sin(np.pi / 2 * (np.arange(n) + 0.5) / n) ** 2).astype(np.float32)


def header_samples(told: BurstHeader, grid: Numerology) -> NDArray[np.complex64]:
    """The header's samples `[n · n_symbol]` as sent, with their peaks clipped."""
    coded = header_bits(told, header.n_symbols(grid) * grid.n_data)
    return mapping(Modulation.BPSK, grid).to_samples(coded, 0, MCS_TABLE[HEADER_MCS].peak)
