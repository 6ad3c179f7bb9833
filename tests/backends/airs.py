"""Simulated airs that nodes share, and helpers to examine what arrives there."""

import numpy as np

from backends import AirParams, RadioParams, TxBurst, World
from backends.testing import Medium
from tests.backends.radios import noise

RATE = 1e6
CENTRE_HZ = 2.4e9
SEED = 31
PLAIN = RadioParams()


def half_duplex(turnaround_s=0.0, **more):
    return RadioParams(full_duplex=False, turnaround_s=turnaround_s, **more)


def air(**params):
    """An air with this sample rate and carrier."""
    return AirParams(**{"rate_hz": RATE, "frequency_hz": CENTRE_HZ, **params})


def medium(radios, seed=SEED, tracks=(), links=(), outages=(), **params):
    """Nodes on an air, all present from time 0 on; `radios`: their number, or the radio of each."""
    if isinstance(radios, int):
        radios = dict.fromkeys(range(radios), PLAIN)
    shared = air(**params)
    made = Medium(shared, World(shared, dict(tracks), links, outages), seed)
    for node, radio in radios.items():
        made.join(node, radio, 0.0)
    return made


def line(pieces):
    """Everything that arrives, `[n]`; zeros for silence and where the node is deaf."""
    parts = [
        np.zeros(piece.n, np.complex64) if piece.samples is None else piece.samples
        for piece in pieces
    ]
    return np.concatenate([np.zeros(0, np.complex64), *parts])


def deafness(pieces):
    """Whether the node is deaf at each sample `[n]`."""
    return np.repeat([piece.is_deaf for piece in pieces], [piece.n for piece in pieces])


def heard(made, node, until_s):
    """Everything that arrives at a node up to `until_s`."""
    return line(made.take(node, until_s))


def loud(x):
    """Positions of all samples that are not zero."""
    return np.flatnonzero(np.abs(x) > 1e-9).tolist()


def burst(start, n, seed=SEED, exact=False):
    """White noise from `start` on."""
    return TxBurst(start, noise(n, seed), start if exact else None)


def power_db(x):
    return 10 * np.log10(np.mean(np.abs(x) ** 2))


def smooth(n, seed=SEED):
    """Noise without the upper half of its frequencies `[n]`, which interpolates well."""
    spectrum = np.fft.fft(noise(n, seed))
    spectrum[n // 4 : -n // 4] = 0
    x = np.fft.ifft(spectrum) * np.hanning(n)
    return x.astype(np.complex64)


def delay_of(x, reference, finer=64):
    """Start of `reference` in `x` in samples: the interpolated peak of the correlation."""
    n = len(x) + len(reference)
    spectrum = np.fft.fft(x, n) * np.conj(np.fft.fft(reference, n))
    fine = np.zeros(n * finer, complex)
    fine[: n // 2], fine[-(n // 2) :] = spectrum[: n // 2], spectrum[-(n // 2) :]
    peak = int(np.argmax(np.abs(np.fft.ifft(fine))))
    return peak / finer


def frequency_of(x):
    """Frequency of a tone in cycles per sample: the slope of its phase."""
    phase = np.unwrap(np.angle(x.astype(complex)))
    return np.polyfit(np.arange(len(x)), phase, 1)[0] / (2 * np.pi)
