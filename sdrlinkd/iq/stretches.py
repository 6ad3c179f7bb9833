"""Finds the stretches of a recording that are not silent."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from backends import Samples
from sdrlinkd.errors import UserError
from sdrlinkd.iq.recording import PIECE, IqRecording, Progress

WINDOW = 32
"""Length in samples of a window, whose mean power is measured."""
ABOVE_DB = 7.0
"""Power above the quietest part, in dB, from which samples are not silence."""
PAUSE = 8
"""Number of silent windows that ends a stretch; fewer may occur within a burst or between two."""
N_LOOKS = 256
LOOK = 1 << 13
QUIET_PERCENT = 2
LEAST = 1e-20


class Stretch(NamedTuple):
    """A stretch of `n` samples from `start` on that are not silence."""

    start: int
    n: int
    power: float
    """Mean power; 1 is a tone of full scale."""
    peak: float
    """The largest magnitude of a value, real or imaginary."""


def silence_of(recording: IqRecording) -> float:
    """The power below which a recording counts as silent: a little above its quietest part.

    Samples that are mostly 0 and otherwise the smallest step count as silent, too. Gaps without
    samples are not considered.
    """
    n_samples, kind = recording.info.n_samples, recording.info.type
    firsts = np.linspace(0, max(0, n_samples - LOOK), N_LOOKS).astype(int)
    looks = [_heard_powers(recording, int(first)) for first in np.unique(firsts)]
    heard = np.concatenate(looks)
    quiet = float(np.percentile(heard, QUIET_PERCENT)) if len(heard) else 0.0
    step = 0.0 if kind.dtype.kind == "f" else 1 / kind.full_scale
    return max(quiet * 10 ** (ABOVE_DB / 10), 2 * step**2)


def stretches_of(
    recording: IqRecording, silence: float, most: int, progress: Progress
) -> list[Stretch]:
    """Stretches with more power than `silence`, each of at most `most` samples.

    Raises UserError when one is longer.
    """
    runs: list[tuple[int, int]] = []
    n_samples = recording.info.n_samples
    for first in range(0, n_samples, PIECE):
        for begin, end in _loud_runs(_powers(recording.read(first, PIECE)) > silence):
            run = first // WINDOW + begin, first // WINDOW + end
            if runs and run[0] - runs[-1][1] < PAUSE:
                run = runs.pop()[0], run[1]
            runs.append(run)
            if (run[1] - run[0]) * WINDOW > most:
                raise _too_long(recording, run[0] * WINDOW, most, silence)
        progress(min(first + PIECE, n_samples))
    return [_stretch(recording, *run) for run in runs]


def _heard_powers(recording: IqRecording, first: int) -> NDArray[np.float32]:
    powers = _powers(recording.read(first, LOOK))
    begins = first + WINDOW * np.arange(len(powers))
    is_heard = np.ones(len(powers), bool)
    for start, n in recording.info.gaps:
        if start < first + LOOK and first < start + n:
            is_heard &= (begins + WINDOW <= start) | (begins >= start + n)
    return powers[is_heard]


def _powers(samples: Samples) -> NDArray[np.float32]:
    """Mean power of each window; the last window may be shorter."""
    rest = -len(samples) % WINDOW
    parts = np.nan_to_num(np.pad(samples, (0, rest))).view(np.float32)
    powers: NDArray[np.float32] = np.square(parts).reshape(-1, 2 * WINDOW).sum(axis=1) / WINDOW
    return powers


def _loud_runs(loud: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(loud.astype(np.int8), prepend=0, append=0))
    return [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]


def _stretch(recording: IqRecording, begin: int, end: int) -> Stretch:
    """The stretch of windows `begin` to `end`, plus one on each side, as slow rises start early."""
    start = max(0, begin - 1) * WINDOW
    samples = recording.read(start, (end + 1) * WINDOW - start)
    parts = np.nan_to_num(samples).view(np.float32)
    loud = parts[2 * (begin * WINDOW - start) : 2 * (end * WINDOW - start)]
    power = 2 * float(np.mean(np.square(loud), dtype=np.float64))
    return Stretch(start, len(samples), power, float(np.abs(parts).max()))


def _too_long(recording: IqRecording, start: int, most: int, silence: float) -> UserError:
    rate_hz = recording.info.rate_hz
    at, allowed = (
        (f"{start / rate_hz:.3f} s", f"{most / rate_hz:g} s")
        if rate_hz
        else (f"sample {start}", f"{most} samples")
    )
    level_db = 10 * np.log10(max(silence, LEAST))
    return UserError(
        f"{recording.info.path}: the stretch at {at} lasts longer than "
        f"{allowed} without silence; allowed: shorter ones. Silence is below "
        f"{level_db:.1f} dBFS here; change it with --silence-db"
    )
