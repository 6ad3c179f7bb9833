"""Channels that change while a burst is on the air."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

BLOCK = 64
"""Samples for which the channel is constant: at 100 km/h and 1 Msps it turns by 0.1 rad."""
N_PATHS = 16
"""Number of waves that make up each echo."""


def jakes(
    n_echoes: int, doppler_hz: float, at: NDArray[np.float64], rng: Generator
) -> NDArray[np.complex128]:
    """Rayleigh gains `[len(at), n_echoes]` of mean power 1 at the times `at` in s.

    Each echo is the sum of N_PATHS waves from all directions (Jakes 1974).
    """
    angle = 2 * np.pi * rng.random((n_echoes, N_PATHS))
    phase = 2 * np.pi * rng.random((n_echoes, N_PATHS))
    turn = 2 * np.pi * doppler_hz * at[:, None, None] * np.cos(angle) + phase
    gains: NDArray[np.complex128] = np.exp(1j * turn).sum(axis=-1) / np.sqrt(N_PATHS)
    return gains


def moving_filter(x: NDArray[np.complex64], taps: NDArray[np.complex64]) -> NDArray[np.complex64]:
    """`x` through FIR filters `taps` `[blocks, n_taps]`, each used for BLOCK samples."""
    # Imported here: scipy loads more slowly than this whole package, and most radios do not move.
    from scipy import fft

    n_blocks, n_taps = taps.shape
    n = BLOCK + n_taps - 1
    size = fft.next_fast_len(n)
    padded = np.zeros((n_blocks, BLOCK), np.complex64)
    padded.reshape(-1)[: len(x)] = x
    parts = fft.ifft(fft.fft(padded, size) * fft.fft(taps, size))[:, :n]
    out = np.zeros(n_blocks * BLOCK + n, np.complex64)
    for i, part in enumerate(parts):
        out[i * BLOCK : i * BLOCK + n] += part
    return out[: len(x) + n_taps - 1]
