"""Power over frequency and time of a recording."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from sdrlinkd.iq.recording import IqRecording, Progress

N_BINS = 512
MAX_COLUMNS = 800
# Most frames per column; a longer recording is sampled, not read completely.
MAX_FRAMES = 64


class Spectrum(NamedTuple):
    """Powers in dBFS per bin (Hann window); frequencies in cycles per sample, times in samples."""

    frequency: NDArray[np.float64]
    mean: NDArray[np.float64]
    peak: NDArray[np.float64]
    time: NDArray[np.float64]
    waterfall: NDArray[np.float64]
    """Power over time and frequency, of shape `[n_columns, N_BINS]`."""


def spectrum_of(recording: IqRecording, progress: Progress) -> Spectrum:
    """Mean, peak and waterfall of the spectrum over the whole recording."""
    n_samples = recording.info.n_samples
    n_columns = max(1, min(MAX_COLUMNS, n_samples // N_BINS))
    step = n_samples / n_columns
    window = np.hanning(N_BINS + 1)[:-1].astype(np.float32)
    window /= window.sum()
    rows = np.zeros((n_columns, N_BINS))
    peak = np.zeros(N_BINS)
    for column in range(n_columns):
        first = round(column * step)
        wanted = min(MAX_FRAMES * N_BINS, max(N_BINS, round(step)))
        samples = recording.read(first, wanted)
        if len(samples) < N_BINS:
            samples = np.pad(samples, (0, N_BINS - len(samples)))
        n_frames = len(samples) // N_BINS
        frames = samples[: n_frames * N_BINS].reshape(n_frames, N_BINS)
        bins = fft.fft(np.nan_to_num(frames) * window, axis=-1)
        power = bins.real**2 + bins.imag**2
        rows[column] = power.mean(axis=0)
        peak = np.maximum(peak, power.max(axis=0))
        progress(min(first + round(step), n_samples))
    return Spectrum(
        fft.fftshift(fft.fftfreq(N_BINS)),
        _decibel(rows.mean(axis=0)),
        _decibel(peak),
        np.arange(n_columns, dtype=np.float64) * step,
        np.stack([_decibel(row) for row in rows]),
    )


def _decibel(power: NDArray[np.float64]) -> NDArray[np.float64]:
    shifted: NDArray[np.float64] = 10 * np.log10(np.maximum(fft.fftshift(power), 1e-20))
    return shifted
