"""Carriers to samples and back: one FFT a symbol."""

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from phy.kernels.symbols import gather
from phy.numerology import Numerology


def to_samples(spectrum: NDArray[np.complex64], grid: Numerology) -> NDArray[np.complex64]:
    """FFT bins `[n, n_fft]` as samples with cyclic prefix `[n (n_cp + n_fft)]`, mean power 1.

    `spectrum` is used up.
    """
    spectrum *= np.float32(grid.scale)
    body = fft.ifft(spectrum, axis=-1, overwrite_x=True)
    samples = np.empty((len(body), grid.n_symbol), np.complex64)
    samples[:, : grid.n_cp] = body[:, -grid.n_cp :]
    samples[:, grid.n_cp :] = body
    return samples.reshape(-1)


def to_bins(
    samples: NDArray[np.complex64],
    starts: NDArray[np.int64],
    frequency: float,
    dc: complex,
    grid: Numerology,
    origin: int = 0,
) -> NDArray[np.complex64]:
    """FFT bins `[n, n_fft]` of the windows that begin at `starts`.

    Before, `dc` is taken off and the samples are turned back by `frequency` cycles a sample, with
    phase 0 `origin` samples before `samples[0]`. A carrier sent as 1 arrives as 1 through a channel
    of gain 1.
    """
    windows = np.empty((len(starts), grid.n_fft), np.complex64)
    gather(samples, starts, frequency, origin, dc, 1 / grid.scale, windows)
    bins: NDArray[np.complex64] = fft.fft(windows, axis=-1, overwrite_x=True)
    return bins
