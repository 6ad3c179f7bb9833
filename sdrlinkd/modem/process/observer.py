"""Looks at the air for people: bursts, spectrum and constellation, while somebody watches."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

import phy
from backends import RxBlock
from sdrlinkd.pdulink import AirSeen, BurstSeen, LineSeen

PERIOD_S = 0.2
N_BINS = 128
N_FFT = 2 * N_BINS
MOST_BURSTS = 400
"""Most bursts told at a time; in 0.2 s, no more fit the air that a person can look at."""
MOST_POINTS = 256
POINT_STEPS = 32
"""Steps of a point's coordinates for the mean amplitude."""
LEAST_DBFS = -128.0

_WINDOW = np.hanning(N_FFT).astype(np.float32)
_GAIN = float(np.sum(_WINDOW**2)) * N_FFT


class Observer:
    """Gathers what `tell` gets every PERIOD_S of the stream; for the demodulating thread only."""

    def __init__(
        self, receiver: "phy.Receiver", grid: phy.Numerology, rate_hz: float,
        lines: Callable[[], list[LineSeen]], tell: Callable[[AirSeen], object],
    ) -> None:  # fmt: skip
        self._receiver = receiver
        self._grid = grid
        self._rate_hz = rate_hz
        self._lines = lines
        self._tell = tell
        self._told_at: int | None = None
        self._bursts: list[BurstSeen] = []
        self._sum = np.zeros(N_FFT)
        self._most = np.zeros(N_FFT)
        self._n = 0
        self._n_bad = receiver.counters["headers_bad"]
        self._points = np.empty(0, np.complex64)
        self._modulation = ""
        receiver.on_points = self._take_points

    def stop(self) -> None:
        """Look no longer."""
        self._receiver.on_points = None

    def take(self, block: RxBlock, events: Sequence[phy.Event]) -> None:
        """Take a block, and the events that it completed."""
        if self._told_at is None:
            self._told_at = block.index
        elif block.index - self._told_at >= PERIOD_S * self._rate_hz:
            # Before this block: the PDUs of the bursts before it have been delivered.
            self._told_at = block.index
            self._tell(self._gathered(block.index))
        for event in events:
            if isinstance(event, phy.BurstOver) and len(self._bursts) < MOST_BURSTS:
                self._bursts.append(self._seen(event))
        if block.samples is not None and block.n >= N_FFT:
            power = np.abs(np.fft.fft(block.samples[:N_FFT] * _WINDOW)) ** 2 / _GAIN
            self._sum += power
            np.maximum(self._most, power, out=self._most)
            self._n += 1

    def _gathered(self, end: int) -> AirSeen:
        n_bad = self._receiver.counters["headers_bad"]
        seen = AirSeen(
            end / self._rate_hz, self._rate_hz, self._bursts,
            _levels(self._sum / max(1, self._n)), _levels(self._most),
            _coordinates(self._points), self._modulation, n_bad - self._n_bad, self._lines(),
        )  # fmt: skip
        self._bursts, self._n, self._n_bad = [], 0, n_bad
        self._sum[:] = self._most[:] = 0
        self._points = self._points[:0]
        return seen

    def _seen(self, event: phy.BurstOver) -> BurstSeen:
        burst, rate = event.burst, self._rate_hz
        plan = phy.layout(self._grid, burst.mcs, burst.n_pdus, burst.pdu_bytes)
        return BurstSeen(
            burst.start / rate, plan.n_samples / rate, burst.mcs, burst.n_pdus, event.n_good,
            burst.snr_db, burst.rssi_dbfs, event.ending,
        )  # fmt: skip

    def _take_points(self, points: NDArray[np.complex64], modulation: phy.Modulation) -> None:
        self._points = points.ravel()[-MOST_POINTS:].copy()
        self._modulation = modulation.name


def _levels(power: NDArray[np.float64]) -> bytes:
    """N_BINS levels in dB relative to full scale, as int8, the lowest frequency first."""
    folded = np.fft.fftshift(power).reshape(N_BINS, -1).sum(axis=1)
    with np.errstate(divide="ignore"):
        levels = 10 * np.log10(folded)
    return bytes(np.clip(levels, LEAST_DBFS, 0).astype(np.int8))


def _coordinates(points: NDArray[np.complex64]) -> bytes:
    """Pairs of int8 in steps of 1 / POINT_STEPS."""
    pairs = points.view(np.float32) * POINT_STEPS
    return bytes(np.clip(np.nan_to_num(pairs), -127, 127).astype(np.int8))
