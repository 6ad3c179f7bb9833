"""From a detector's peak to a burst whose header is read and whose channel is known."""

import cmath
import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy import estimation, header, ofdm, preamble, synchronisation
from phy.convolutional import N_TAIL, ViterbiWorkspace
from phy.demodulation import Demodulator, new_tracking
from phy.estimation import BACKOFF, ChannelEstimate
from phy.header import BurstHeader, parse_header
from phy.kernels.training import energy
from phy.mcs import HEADER_MCS, MCS_TABLE
from phy.numerology import Numerology
from phy.quality import BurstQuality
from phy.transmitter import header_spectrum

BEFORE = preamble.SHORT + preamble.GUARD + synchronisation.SEARCH + BACKOFF
"""Samples that acquisition needs before the nominal start of the first long symbol."""


def needed_after(grid: Numerology) -> int:
    """Samples that it needs from there on."""
    return synchronisation.SEARCH + preamble.N_LONG * grid.n_fft + header.N_SYMBOLS * grid.n_symbol


class Acquired(NamedTuple):
    """A burst that can be decoded. `window` is where the first payload symbol's FFT begins."""

    header: BurstHeader
    quality: BurstQuality
    window: int
    frequency: float
    channel: ChannelEstimate
    tracking: NDArray[np.float64]


class Missed(NamedTuple):
    """No burst: "preamble" (no long training found) or "header" (its check failed)."""

    stage: str


class Acquisition:
    """Tables and settings of acquisition on one grid."""

    def __init__(self, grid: Numerology, max_frequency: float) -> None:
        self._grid = grid
        self._aliases = synchronisation.n_aliases(max_frequency)
        self._demodulator = Demodulator(MCS_TABLE[HEADER_MCS].modulation, grid)
        self._workspace = ViterbiWorkspace(header.N_BITS + N_TAIL)
        long_starts = grid.n_fft * np.arange(preamble.N_LONG)
        header_starts = grid.n_cp + grid.n_symbol * np.arange(header.N_SYMBOLS)
        self._starts = np.concatenate((long_starts, preamble.N_LONG * grid.n_fft + header_starts))

    def acquire(
        self, x: NDArray[np.complex64], base: int, coarse: float, dc: complex
    ) -> Acquired | Missed:
        """Read the burst whose first long symbol is nominally at `x[BEFORE]`.

        `base` is the absolute index of `x[0]`; `coarse` the frequency that the peak tells.
        """
        grid = self._grid
        x = x - np.complex64(dc)
        timing = synchronisation.locate(x, BEFORE, coarse, self._aliases, grid)
        if timing is None:
            return Missed("preamble")
        window = timing.long_start - BACKOFF
        training = self._bins(x, window, timing.frequency, preamble.N_LONG)
        rough = estimation.estimate(training, preamble.LONG_TRAINING, grid)
        frequency = synchronisation.refine(x, timing, rough.h_hat, grid)
        bins = self._bins(x, window, frequency, preamble.N_LONG + header.N_SYMBOLS)
        channel = estimation.estimate(bins[: preamble.N_LONG], preamble.LONG_TRAINING, grid)
        tracking = new_tracking(channel, grid)
        llr, points = self._demodulator.demap(
            bins[preamble.N_LONG :], channel, tracking, first_symbol=0
        )
        told = parse_header(llr, self._workspace)
        if told is None:
            return Missed("header")
        sent = _header_carriers(told, grid)
        channel = self._with_header(bins, sent, tracking)
        error = points - sent[:, grid.data_at]
        quality = self._quality(x, timing, told, channel, error, base, frequency)
        payload = window + preamble.N_LONG * grid.n_fft + header.N_SYMBOLS * grid.n_symbol
        return Acquired(told, quality, base + payload + grid.n_cp, frequency, channel, tracking)

    def _bins(
        self, x: NDArray[np.complex64], window: int, frequency: float, n: int
    ) -> NDArray[np.complex64]:
        """The first `n` of two long symbols and two of the header, phase 0 at `window`."""
        return ofdm.to_bins(x[window:], self._starts[:n], frequency, 0j, self._grid)

    def _with_header(
        self,
        bins: NDArray[np.complex64],
        sent: NDArray[np.complex64],
        tracking: NDArray[np.float64],
    ) -> ChannelEstimate:
        """The estimate anew, with the header, now known, as further training."""
        for back in range(header.N_SYMBOLS):
            phase = tracking[0, 0] - back * tracking[0, 1]
            bins[-1 - back] *= np.complex64(cmath.exp(-1j * phase))
        return estimation.estimate(bins, np.concatenate((preamble.LONG_TRAINING, sent)), self._grid)

    def _quality(
        self,
        x: NDArray[np.complex64],
        timing: synchronisation.Timing,
        told: BurstHeader,
        channel: ChannelEstimate,
        error: NDArray[np.complex64],
        base: int,
        frequency: float,
    ) -> BurstQuality:
        grid = self._grid
        start = timing.long_start - preamble.GUARD - preamble.SHORT
        body = x[timing.long_start : timing.long_start + preamble.N_LONG * grid.n_fft]
        occupied = grid.n_used / grid.n_fft
        return BurstQuality(
            start=base + start,
            mcs=told.mcs,
            n_pdus=told.n_pdus,
            pdu_bytes=told.pdu_bytes,
            network=told.network,
            snr_db=_decibel(channel.gain * occupied / channel.no),
            rssi_dbfs=_decibel(energy(body) / len(body)),
            evm_db=_decibel(energy(error.reshape(-1)) / error.size),
            cfo=frequency,
        )


@lru_cache(maxsize=64)
def _header_carriers(told: BurstHeader, grid: Numerology) -> NDArray[np.complex64]:
    """The header as sent `[2, n_used]`."""
    return header_spectrum(told, grid)[:, grid.bins]


def _decibel(ratio: float) -> float:
    return round(10 * math.log10(max(ratio, 1e-30)), 3)
