"""Signals for the modem's tests, and helpers to receive them."""

import numpy as np

from phy import BurstOver, PduHeard, Receiver


def silence(n):
    """`n` samples of silence."""
    return np.zeros(n, np.complex64)


def noise(rng, n, power=1.0):
    """White complex noise of that mean power `[n]`."""
    samples = rng.standard_normal(2 * n, np.float32).view(np.complex64)
    return samples * np.float32(np.sqrt(power / 2))


def noisy(rng, x, snr_db):
    """`x` in noise that far below a mean power of 1."""
    return x + noise(rng, len(x), 10 ** (-snr_db / 10))


def turned(x, frequency, phase=0.0):
    """`x` with a frequency offset in cycles per sample."""
    turn = np.exp(2j * np.pi * (frequency * np.arange(len(x)) + phase))
    return (x * turn).astype(np.complex64)


def payloads(rng, n, size):
    """`n` PDUs of random bytes."""
    return [rng.bytes(size) for _ in range(n)]


def hear(samples, **settings):
    """(events, counters) of a new receiver for all of `samples`."""
    receiver = Receiver(**settings)
    events = receiver.push(samples) + receiver.flush()
    return events, receiver.counters


def heard(events):
    """The content of the PDUs among `events`."""
    return [event.data for event in events if isinstance(event, PduHeard)]


def endings(events):
    """How the bursts among `events` ended."""
    return [event.ending for event in events if isinstance(event, BurstOver)]
