"""The modem's cost, as a multiple of numpy's own work in the same process.

The reference is an FFT of as many samples, 64 at a time, and a product of as many: the least that
any OFDM receiver in numpy does. Limits are twice the measured values, because machines differ.
"""

from time import thread_time

import numpy as np
import pytest

from phy import Receiver, Transmitter
from tests.phy.signals import noise, noisy, payloads, silence

SEED = 71
ROUNDS = 7


def best_s(work):
    """The least CPU time of this thread."""
    work()
    took = []
    for _ in range(ROUNDS):
        begin = thread_time()
        work()
        took.append(thread_time() - begin)
    return min(took)


def yardstick_s(n):
    """CPU time of the reference work for `n` samples."""
    x = noise(np.random.default_rng(SEED), 1 << 13).reshape(-1, 64)
    return best_s(lambda: [np.fft.fft(x) * x for _ in range(16)]) * n / (16 * x.size)


def hear(receiver, x):
    for first in range(0, len(x), 8192):
        receiver.push(x[first : first + 8192])


def stream(mcs, n_pdus, size, n_bursts):
    rng = np.random.default_rng(SEED)
    parts = []
    for _ in range(n_bursts):
        parts += [silence(100), Transmitter().modulate(payloads(rng, n_pdus, size), mcs)]
    return noisy(rng, np.concatenate(parts), 30)


def test_searching_costs_little():
    x, receiver = noise(np.random.default_rng(SEED), 1 << 18), Receiver()
    assert best_s(lambda: hear(receiver, x)) < 2 * yardstick_s(len(x))


@pytest.mark.parametrize(
    ("mcs", "n_pdus", "size", "most"), [(1, 16, 220, 6), (6, 16, 220, 11), (1, 1, 64, 20)]
)
def test_hearing_costs_little(mcs, n_pdus, size, most):
    x, receiver = stream(mcs, n_pdus, size, 64 // n_pdus), Receiver()
    assert best_s(lambda: hear(receiver, x)) < most * yardstick_s(len(x))
    assert receiver.counters["pdus_bad"] == 0
    assert receiver.counters["pdus_good"] >= 64 * ROUNDS


def test_sending_costs_little():
    rng, transmitter = np.random.default_rng(SEED), Transmitter()
    pdus = payloads(rng, 64, 220)
    n = sum(len(transmitter.modulate([pdu], 1)) for pdu in pdus)
    assert best_s(lambda: [transmitter.modulate([p], 1) for p in pdus]) < 4 * yardstick_s(n)
