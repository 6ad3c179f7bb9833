"""Symbols to LLRs, and LLRs to PDUs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from phy.constellation import Modulation
from phy.crc import checked
from phy.estimation import ChannelEstimate
from phy.kernels.demapper import demap
from phy.layout import BurstLayout
from phy.ldpc import LdpcWorkspace, decode
from phy.mapping import mapping
from phy.numerology import Numerology
from phy.sequences import polarity, whitening

# Frequency error of the preamble's estimate, in carrier spacings: at 0 dB, and at best.
_FREQUENCY_ERROR_0_DB = 0.006
_FREQUENCY_ERROR_MIN = 0.0005
# However strong a signal, echoes and converters leave so much on a carrier.
_LEAST_NOISE = 1e-4
# Sampling clocks differ by up to this (one standard deviation).
_CLOCK_ERROR = 40e-6


def new_tracking(channel: ChannelEstimate, grid: Numerology) -> NDArray[np.float64]:
    """Phase and slope over carriers as they stand after the preamble `[2, 5]`."""
    tracking = np.zeros((2, 5))
    noise_to_signal = channel.no / channel.gain
    error = max(_FREQUENCY_ERROR_0_DB * np.sqrt(noise_to_signal), _FREQUENCY_ERROR_MIN)
    turn = 2 * np.pi * grid.n_symbol / grid.n_fft
    tracking[0, 4] = (turn * error) ** 2
    tracking[1, 4] = (turn * _CLOCK_ERROR) ** 2
    return tracking


class Demodulator:
    """Equaliser and demapper of one modulation on one grid."""

    def __init__(self, modulation: Modulation, grid: Numerology) -> None:
        self._grid = grid
        self._bits, self._unit = modulation.bits, modulation.unit
        order = mapping(modulation, grid).order
        plane, carrier = order % modulation.bits, order // modulation.bits
        self._gather = (plane * grid.n_data + carrier).astype(np.int32)
        self._h_bins = np.zeros(grid.n_fft, np.complex64)
        self._data_bins = grid.bins[grid.data_at]
        self._pilot_bins = grid.bins[grid.pilots_at]
        self._data_carriers = grid.used[grid.data_at]
        self._pilot_carriers = grid.used[grid.pilots_at]

    def demap(
        self,
        bins: NDArray[np.complex64],
        channel: ChannelEstimate,
        tracking: NDArray[np.float64],
        first_symbol: int,
    ) -> tuple[NDArray[np.int16], NDArray[np.complex64]]:
        """(LLRs in the code's order `[n · n_data · bits]`, points `[n, n_data]`) of FFT bins.

        `tracking` moves on; the header's first symbol is number 0.
        """
        n = len(bins)
        llr = np.empty(n * len(self._gather), np.int16)
        points = np.empty((n, self._grid.n_data), np.complex64)
        self._h_bins[self._grid.bins] = channel.h_hat
        demap(
            bins,
            self._h_bins,
            max(channel.no, _LEAST_NOISE * channel.gain),
            self._data_bins,
            self._data_carriers,
            self._pilot_bins,
            self._pilot_carriers,
            self._grid.pilot_values,
            polarity(n, first_symbol),
            self._gather,
            self._bits,
            self._unit,
            self._grid.edge,
            tracking,
            points,
            llr,
        )
        return llr, points


@dataclass
class PduDecoder:
    """Collects LLRs of a burst and decodes each PDU when its symbols are in."""

    layout: BurstLayout
    workspace: LdpcWorkspace

    def __post_init__(self) -> None:
        self.n_decoded = 0
        self._rest = np.empty(0, np.int16)

    def decode(self, llr: NDArray[np.int16], n_pdus: int) -> list[bytes | None]:
        """The next `n_pdus` PDUs, whose last symbols' LLRs are `llr`; None where a check fails."""
        plan = self.layout
        bits = np.concatenate((self._rest, llr))
        if not n_pdus:
            self._rest = bits
            return []
        n_bits = n_pdus * plan.coded_bits
        self._rest = bits[n_bits:]
        size = plan.block_bytes
        decoded = decode(bits[:n_bits].reshape(n_pdus, -1), plan.form, self.workspace)
        white = np.packbits(decoded, axis=1).reshape(-1)
        blocks = (white ^ whitening(len(white), self.n_decoded * size)).tobytes()
        self.n_decoded += n_pdus
        return [checked(blocks[at : at + size]) for at in range(0, len(blocks), size)]
