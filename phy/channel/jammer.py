"""Signals of others that disturb: tones, narrow signals, sweeps, pulses, noise."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Kind = Literal["tone", "narrow", "sweep", "pulses", "noise"]

_N_TABLE = 1 << 16
_N_TONES = 48
"""So many tones at random frequencies make a narrow signal."""


@dataclass(frozen=True)
class JammerParams:
    """What a jammer sends; frequencies in Hz from the channel's centre, times in s.

    `power_dbfs` is its mean power while it sends, in dB relative to full scale. A "tone" is at
    `offset_hz`; "narrow" is noise `width_hz` wide there; "sweep" goes through `width_hz` around it
    in each `period_s`; "pulses" are noise in a share `duty` of each `period_s`; "noise" is always.
    It sends in `times`, of begin and end; without any, always.
    """

    kind: Kind = "tone"
    power_dbfs: float = -40.0
    offset_hz: float = 0.0
    width_hz: float = 0.0
    period_s: float = 0.01
    duty: float = 0.02
    times: tuple[tuple[float, float], ...] = ()


class Jammer:
    """The samples of one jammer at a receiver; they depend on their index alone."""

    def __init__(self, params: JammerParams, rate_hz: float, seed: int) -> None:
        self._params = params
        self._rate_hz = rate_hz
        rng = np.random.default_rng(seed)
        self._amplitude = 10 ** (params.power_dbfs / 20)
        self._phase = rng.uniform(0, 2 * np.pi)
        self._table = np.zeros(0, np.complex64)
        if params.kind in ("pulses", "noise"):
            parts = rng.standard_normal((_N_TABLE, 2), np.float32) * np.float32(np.sqrt(0.5))
            self._table = parts.view(np.complex64)[:, 0]
        self._tones = rng.uniform(-0.5, 0.5, (_N_TONES, 1)) * params.width_hz + params.offset_hz
        self._phases = rng.uniform(0, 2 * np.pi, (_N_TONES, 1))

    def add(self, x: NDArray[np.complex64], index: int) -> NDArray[np.complex64]:
        """Antenna samples `[n]`, the first with absolute `index`, with what the jammer adds.

        `x` is not modified. Any chunking of the same stream gives the same samples.
        """
        params, n = self._params, np.arange(index, index + len(x), dtype=np.float64)
        t = n / self._rate_hz
        is_on = np.ones(len(x), bool)
        if params.times:
            is_on = np.any([(begin <= t) & (t < end) for begin, end in params.times], axis=0)
            if not is_on.any():
                return x
        more = self._amplitude * self._wave(index, t)
        return np.asarray(x + (more * is_on).astype(np.complex64))

    def _wave(self, index: int, t: NDArray[np.float64]) -> NDArray[np.complex128]:
        """The waveform `[n]` of mean power 1 while it sends, at times `t`, from `index` on."""
        params = self._params
        if params.kind == "tone":
            return self._turning(params.offset_hz * t)
        if params.kind == "narrow":
            angles = 2 * np.pi * np.mod(self._tones * t, 1) + self._phases
            return np.asarray(np.sum(np.exp(1j * angles), axis=0) / np.sqrt(_N_TONES))
        within = np.mod(t, params.period_s)
        if params.kind == "sweep":
            width_hz = params.width_hz or self._rate_hz
            slope = width_hz / params.period_s
            cycles = (params.offset_hz - width_hz / 2 + slope / 2 * within) * within
            return self._turning(cycles)
        at = np.arange(index, index + len(t)) % _N_TABLE
        noise = self._table[at].astype(np.complex128)
        if params.kind == "pulses":
            noise *= within < params.duty * params.period_s
        return noise

    def _turning(self, cycles: NDArray[np.float64]) -> NDArray[np.complex128]:
        """A carrier that has turned by so many cycles."""
        return np.asarray(np.exp(1j * (2 * np.pi * np.mod(cycles, 1) + self._phase)))
