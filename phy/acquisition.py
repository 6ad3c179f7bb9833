"""Leads from a detector's peak to a burst with a decoded header and a known channel."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from phy import compute, header, ofdm, preamble
from phy.constellation import Modulation
from phy.convolutional import N_TAIL
from phy.cuts import Cuts
from phy.estimation import in_planes, new_channel, new_scratch, tones
from phy.header import BurstHeader
from phy.header_code import parse_header
from phy.mapping import axes
from phy.numerology import Numerology
from phy.quality import BurstQuality
from phy.sizes import whole_lanes
from phy.tables.acquisition import (
    AMBIGUITY,
    BACKOFF,
    FIRST_CLEAN,
    N_CLEAN,
    PART,
    SEARCH,
    Room,
    Training,
)
from phy.tables.block import ArgumentBlock
from phy.tables.burst import Channel
from phy.transmitter import header_samples

# Error that noise may add to the frequency of the detector's peak, in cycles per sample.
_COARSE_ERROR = 0.008
# Corrections that the last step tries, in cycles per sample: up to 0.12 of 1/64, the unit of the
# phase measured over 64 samples. A parabola finds the maximum between them.
_FREQUENCIES = np.linspace(-0.12, 0.12, 25) / 64


def before(grid: Numerology) -> int:
    """Samples that acquisition needs before the nominal start of the first long symbol."""
    return preamble.long_start(grid) + SEARCH + BACKOFF


def needed_after(grid: Numerology) -> int:
    """Samples that acquisition needs from the nominal start of the first long symbol on."""
    n_header = header.n_symbols(grid) * grid.n_symbol
    return SEARCH + preamble.N_LONG * grid.n_fft + n_header


class Acquired(NamedTuple):
    """A burst with a decoded header and a known channel.

    `window` is the absolute index at which the FFT of the first payload symbol begins. `frequency`
    is the frequency offset in cycles per sample, with phase 0 at index `origin`; `channel` includes
    that phase reference. A receiver has only one channel: the next burst overwrites it.
    """

    header: BurstHeader
    quality: BurstQuality
    origin: int
    window: int
    frequency: float
    channel: ArgumentBlock[Channel]


class Missed(NamedTuple):
    """A peak without a burst: "preamble" (no long training found) or "header" (no valid one)."""

    stage: str


class Acquisition:
    """Acquires bursts on one grid, with its own tables and working memory. Not thread-safe."""

    def __init__(self, grid: Numerology, max_frequency: float, centre_cycles: float = 0.0) -> None:
        self._grid = grid
        self._centre_cycles = centre_cycles
        self._nominal = before(grid)
        self._training = _training(grid, n_aliases(max_frequency))
        self._payload_at = int(self._training.content.windows[-1]) + grid.n_symbol
        self._tones = tones(grid)
        self._axes = axes(Modulation.BPSK, grid)
        self._channel = new_channel(grid)
        self._scratch = new_scratch(grid)
        self._room = _new_room(grid)
        self._n_marked = 0

    def leave_out(
        self, kept: NDArray[np.float32] | None, whole: NDArray[np.float32] | None = None
    ) -> None:
        """Leave subcarriers out of the next symbols that are 0 in `kept` `[n, n_used]`.

        `whole` `[n]` is the share of each symbol's samples that were not blanked; None: all.
        """
        channel = self._channel.content
        if self._n_marked:
            channel.kept[: self._n_marked] = channel.whole[: self._n_marked] = 1
            self._n_marked = 0
        if kept is not None:
            self._n_marked = len(kept)
            channel.kept[: len(kept), : self._grid.n_used] = kept[:, self._grid.tones]
        if whole is not None:
            self._n_marked = len(whole)
            channel.whole[: len(whole)] = whole

    def acquire(
        self,
        x: NDArray[np.complex64],
        base: int,
        coarse: float,
        dc: complex,
        cuts: Cuts | None = None,
    ) -> Acquired | Missed:
        """Read the burst whose first long symbol is nominally at `x[before(grid)]`.

        `base` is the absolute index of `x[0]`; `coarse` is the frequency of the detector's peak, in
        cycles per sample, modulo 1/16. `cuts` is what an excisor took out.
        """
        grid, room = self._grid, self._room.content
        windows = self._training.content.windows
        if cuts is not None:
            starts = np.arange(base + self._nominal, base + len(x), grid.n_fft)
            kept = cuts.kept(starts, coarse, grid)
            # A subcarrier that is cut anywhere is left out of training and header.
            always = None if kept is None else np.tile(kept.min(0), (header.n_symbols(grid), 1))
            # About where the header is: it need not be known better.
            about = base + self._nominal - windows[0] + windows[preamble.N_LONG :]
            self.leave_out(always, cuts.whole(about, grid))
        start, frequency = compute.acquire(
            x, self._nominal, coarse, dc, self._centre_cycles,
            self._training, self._tones, self._axes,
            self._channel, self._scratch, self._room,
        )  # fmt: skip
        if start < 0:
            return Missed("preamble")
        told = parse_header(room.octets, room.folded)
        if told is None:
            return Missed("header")
        if cuts is not None:
            self.leave_out(always, cuts.whole(base + start - BACKOFF + windows, grid))
        snr_db, rssi_dbfs, evm_db = compute.settle(
            _sent(told, grid), self._training, self._tones,
            self._channel, self._scratch, self._room,
        )  # fmt: skip
        quality = BurstQuality(
            base + start, *told, snr_db=snr_db, rssi_dbfs=rssi_dbfs, evm_db=evm_db, cfo=frequency
        )
        origin = base + start - BACKOFF
        return Acquired(told, quality, origin, origin + self._payload_at, frequency, self._channel)


def n_aliases(max_frequency: float) -> int:
    """Multiples of 1/16 cycle per sample to try on each side, for offsets up to `max_frequency`."""
    return max(0, math.ceil((max_frequency + _COARSE_ERROR - AMBIGUITY / 2) / AMBIGUITY))


@lru_cache(maxsize=8)
def _training(grid: Numerology, aliases: int) -> ArgumentBlock[Training]:
    n_fft, n_header = grid.n_fft, header.n_symbols(grid)
    time, subcarriers = np.arange(n_fft)[:, None], tones(grid).content.subcarriers
    shift = np.exp(2j * np.pi * AMBIGUITY * np.arange(-aliases, aliases + 1)[:, None] * time[:, 0])
    inverse = np.exp(2j * np.pi * subcarriers * time / n_fft) * (grid.scale / n_fft)
    short_wave = inverse[: preamble.SEGMENT] * preamble.short_subcarriers(grid)[grid.tones]
    clean = np.roll(short_wave, -FIRST_CLEAN, axis=0)
    clean[N_CLEAN:] = 0
    long = preamble.long_subcarriers(grid)[grid.tones].astype(np.complex64)
    long_start = preamble.long_start(grid)
    header_start = preamble.length(grid) + grid.n_cp
    segments = preamble.SEGMENT * np.arange(preamble.N_SEGMENTS)
    parts = PART * np.arange(preamble.N_LONG * n_fft // PART)
    centres = np.concatenate(
        (
            segments + FIRST_CLEAN + (N_CLEAN - 1) / 2,
            parts + long_start + (PART - 1) / 2,
        )
    )
    windows = (
        long_start + n_fft * np.arange(preamble.N_LONG),
        header_start + grid.n_symbol * np.arange(n_header),
    )
    return ArgumentBlock(
        Training(
            templates=(preamble.long_symbol(grid) * shift).astype(np.complex64),
            long=in_planes(np.tile(long, (preamble.N_LONG, 1))),
            waves=_parts_of(np.concatenate((clean, inverse * long)).T),
            cover=preamble.COVER,
            frequencies=_FREQUENCIES,
            turns=_parts_of(np.exp(-2j * np.pi * centres[:, None] * _FREQUENCIES)),
            windows=np.concatenate(windows),
        )
    )


def _parts_of(x: NDArray[np.complex128]) -> NDArray[np.float32]:
    """Real and imaginary parts `[n, 2, m]` of complex rows `[n, m]`."""
    return np.ascontiguousarray(np.stack((x.real, x.imag), axis=1), np.float32)


def _new_room(grid: Numerology) -> ArgumentBlock[Room]:
    n, n_steps = header.n_symbols(grid), header.N_BITS + N_TAIL
    training = _training(grid, 0).content
    return ArgumentBlock(
        Room(
            planes=np.empty((2, before(grid) + needed_after(grid)), np.float32),
            wave=np.empty(training.waves.shape[1:], np.float32),
            parts=np.empty((2, len(training.turns)), np.float32),
            y=np.empty((preamble.N_LONG + n, 2, whole_lanes(grid.n_used)), np.float32),
            points=np.empty((n, grid.n_data), np.complex64),
            llr=np.empty(n * grid.n_data, np.int16),
            folded=np.empty(2 * n_steps, np.int16),
            decisions=np.empty(n_steps, np.uint64),
            octets=np.empty(header.N_BITS // 8, np.uint8),
        )
    )


# Cached because most headers equal an earlier one.
@lru_cache(maxsize=64)
def _sent(told: BurstHeader, grid: Numerology) -> NDArray[np.float32]:
    """The tones of long training and header as sent `[2 + n_header, 2, width]`.

    Each tone x is stored as 1 / x*, so that kernels divide by x when they multiply by the
    conjugate. Header tones are not exactly ±1, because the header's peaks are clipped.
    """
    long = preamble.long_subcarriers(grid)[grid.tones].astype(np.complex64)
    samples = header_samples(told, grid)
    starts = grid.n_cp + grid.n_symbol * np.arange(header.n_symbols(grid))
    re, im = ofdm.to_tones(samples, starts, 0.0, 0j, grid)[:, :, : grid.n_used].swapaxes(0, 1)
    return in_planes(np.concatenate((np.tile(long, (preamble.N_LONG, 1)), 1 / (re - 1j * im))))
