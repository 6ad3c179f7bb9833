"""Carriers to samples and back: one FFT a symbol."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from phy.estimation import new_scratch, tones
from phy.kernels import demodulator as kernel
from phy.kernels.lanes import whole_lanes
from phy.kernels.symbols import with_prefix
from phy.numerology import Numerology


def to_samples(
    spectrum: NDArray[np.complex64],
    grid: Numerology,
    peak: float = math.inf,
    out: NDArray[np.complex64] | None = None,
) -> NDArray[np.complex64]:
    """FFT bins `[n, n_fft]` as samples with cyclic prefix `[n (n_cp + n_fft)]`, mean power 1.

    No sample's magnitude is beyond `peak`. They go to `out` if there is one. `spectrum` is used up.
    """
    body = fft.ifft(spectrum, axis=-1, overwrite_x=True)
    if out is None:
        out = np.empty(len(body) * grid.n_symbol, np.complex64)
    with_prefix(body, grid.scale, peak, out.reshape(len(body), grid.n_symbol))
    return out


def to_tones(
    samples: NDArray[np.complex64],
    starts: NDArray[np.int64],
    frequency: float,
    dc: complex,
    grid: Numerology,
    origin: int = 0,
) -> NDArray[np.float32]:
    """Tones `[n, 2, width]`, real and imaginary parts, of the windows that begin at `starts`.

    Before, `dc` is taken off and the samples are turned back by `frequency` cycles a sample, with
    phase 0 `origin` samples before `samples[0]`. A carrier sent as 1 arrives as 1 through a channel
    of gain 1.
    """
    out = np.empty((len(starts), 2, whole_lanes(grid.n_used)), np.float32)
    scratch = new_scratch(grid)
    kernel.to_tones(samples, starts, frequency, dc, origin, tones(grid).words, scratch.words, out)
    return out
