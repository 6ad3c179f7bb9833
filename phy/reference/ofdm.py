"""OFDM: converts subcarriers to samples with an inverse FFT, and back with an FFT.

The cyclic prefix makes the echoes' convolution circular. So a window that begins inside the prefix
sees every subcarrier times one complex gain, and echoes never mix subcarriers.
"""

import numpy as np
from numpy.typing import NDArray

from phy.numerology import Numerology

Samples = NDArray[np.complex128]
Subcarriers = NDArray[np.complex128]

ROUNDS = 2
"""After so many, a symbol's amplitude is right to within half a per cent."""


def to_samples(subcarriers: Subcarriers, grid: Numerology, peak: float = np.inf) -> Samples:
    """Convert symbols `[n, n_used]` to samples `[n · n_symbol]`, mean power 1, none beyond `peak`.

        x[n] = (1/√52) Σ_k X_k exp(j2πkn/64), its last 16 samples before it

    Subcarriers are in the order of `grid.used`. A sample beyond `peak` is clipped to that
    magnitude: the error of −34 dB and less is below the noise at which the MCS works (`phy.mcs`).
    What that takes of a symbol's amplitude is given back to the whole symbol. Else its gain would
    be that of a channel that fades for one symbol.
    """
    spectrum = np.zeros((len(subcarriers), grid.n_fft), np.complex128)
    spectrum[:, grid.bins] = subcarriers
    # NumPy's inverse FFT divides by 64; `scale` is 64/√52.
    body = np.fft.ifft(spectrum) * grid.scale
    size, kept = np.maximum(np.abs(body), 1e-30), np.ones((len(body), 1))
    for _ in range(ROUNDS):
        left = np.minimum(1, peak * kept / size)
        kept = np.sum(left * size**2, axis=1, keepdims=True) / np.sum(size**2, 1, keepdims=True)
    body = body * np.minimum(1, peak * kept / size) / kept
    return np.concatenate((body[:, -grid.n_cp :], body), axis=1).reshape(-1)


def turned_back(
    samples: NDArray[np.complexfloating], dc: complex, frequency: float, origin: int = 0
) -> Samples:
    """Remove the DC and a frequency offset of `frequency` cycles per sample from samples `[n]`.

        z[n] = (y[n] − d) exp(−j2πfn)

    The phase is 0 `origin` samples before the first one.
    """
    n = np.arange(origin, origin + len(samples))
    z: Samples = (samples.astype(np.complex128) - dc) * np.exp(-2j * np.pi * frequency * n)
    return z


def to_subcarriers(
    samples: NDArray[np.complexfloating],
    starts: NDArray[np.int64],
    frequency: float,
    dc: complex,
    grid: Numerology,
    origin: int = 0,
) -> Subcarriers:
    """Convert FFT windows that begin at `starts` `[n]` to subcarriers `[n, n_used]`.

        Y_k = (√52/64) Σ_n z[n] exp(−j2πkn/64)

    The samples are rotated back first, with phase 0 `origin` samples before `samples[0]`. A
    subcarrier sent as 1 arrives as 1 through a channel of gain 1.
    """
    z = turned_back(samples, dc, frequency, origin)
    windows = z[np.asarray(starts)[:, None] + np.arange(grid.n_fft)]
    spectrum: Subcarriers = np.fft.fft(windows) / grid.scale
    return spectrum[:, grid.bins]
