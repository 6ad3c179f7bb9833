"""Signals of others that disturb: tones, narrow signals, sweeps, pulses, noise."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Kind = Literal["tone", "narrow", "sweep", "pulses", "noise"]
_N_TABLE = 1 << 16
_N_TONES = 48
"""So many tones at random frequencies make a narrow signal."""


class Jammer:
    """The samples of one jammer at a receiver; they depend on their index alone.

    `power_dbfs` is its mean power while it sends, in dB relative to full scale. Frequencies are in
    Hz from the channel's centre, times in s. A "tone" is at `offset_hz`; "narrow" is noise
    `width_hz` wide there; "sweep" goes through `width_hz` around it in each `period_s`; "pulses"
    are noise in a share `duty` of each `period_s`; "noise" is always. A width of 0 is the whole
    band. It sends in `times`, each a begin and an end; without any, always.
    """

    def __init__(
        self, kind: Kind, power_dbfs: float, rate_hz: float, seed: int, *, offset_hz: float = 0.0,
        width_hz: float = 0.0, period_s: float = 0.01, duty: float = 0.02,
        times: Sequence[Sequence[float]] = (),
    ) -> None:  # fmt: skip
        self._kind: Kind = kind
        self._rate_hz = rate_hz
        self._offset_hz, self._width_hz = offset_hz, width_hz or rate_hz
        self._period_s, self._on_s = period_s, duty * period_s
        self._times = times
        rng = np.random.default_rng(seed)
        self._amplitude = 10 ** (power_dbfs / 20)
        self._phase = rng.uniform(0, 2 * np.pi)
        parts = rng.standard_normal((_N_TABLE, 2), np.float32) * np.float32(np.sqrt(0.5))
        self._table = parts.view(np.complex64)[:, 0]
        self._tones = rng.uniform(-0.5, 0.5, (_N_TONES, 1)) * self._width_hz + offset_hz
        self._phases = rng.uniform(0, 2 * np.pi, (_N_TONES, 1))

    def add(self, x: NDArray[np.complex64], index: int) -> NDArray[np.complex64]:
        """Antenna samples `[n]`, the first with absolute `index`, with what the jammer adds.

        `x` is not modified. Any chunking of the same stream gives the same samples.
        """
        t = np.arange(index, index + len(x), dtype=np.float64) / self._rate_hz
        is_on = np.ones(len(x), bool)
        if self._times:
            is_on = np.any([(begin <= t) & (t < end) for begin, end in self._times], axis=0)
            if not is_on.any():
                return x
        more = self._amplitude * self._wave(index, t)
        return np.asarray(x + (more * is_on).astype(np.complex64))

    def _wave(self, index: int, t: NDArray[np.float64]) -> NDArray[np.complex128]:
        """The waveform `[n]` of mean power 1 while it sends, at times `t`, from `index` on."""
        if self._kind == "tone":
            return self._turning(self._offset_hz * t)
        if self._kind == "narrow":
            angles = 2 * np.pi * np.mod(self._tones * t, 1) + self._phases
            return np.asarray(np.sum(np.exp(1j * angles), axis=0) / np.sqrt(_N_TONES))
        within = np.mod(t, self._period_s)
        if self._kind == "sweep":
            slope = self._width_hz / self._period_s
            begin_hz = self._offset_hz - self._width_hz / 2
            return self._turning((begin_hz + slope / 2 * within) * within)
        noise = self._table[np.arange(index, index + len(t)) % _N_TABLE].astype(np.complex128)
        if self._kind == "pulses":
            noise *= within < self._on_s
        return noise

    def _turning(self, cycles: NDArray[np.float64]) -> NDArray[np.complex128]:
        """A carrier that has turned by so many cycles."""
        return np.asarray(np.exp(1j * (2 * np.pi * np.mod(cycles, 1) + self._phase)))
