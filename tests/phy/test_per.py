"""Packet error rates in white noise, and the rate of false detections.

SNR is the burst's mean power over the noise power of a complex sample.
"""

import numpy as np
import pytest

from phy import BurstOver, Receiver, Transmitter
from tests.laws import at_most, often
from tests.phy.foreign import FOREIGN
from tests.phy.quiet import quiet
from tests.phy.signals import heard, noise, noisy, silence, turned

SEED = 41


def n_lost(n, mcs, size, snr_db, max_frequency=0.02, **settings):
    """Number of `n` bursts of one PDU that are lost, each with its own frequency offset."""
    rng = np.random.default_rng(SEED)
    transmitter, receiver = Transmitter(), Receiver(max_frequency=max_frequency, **settings)
    sent, events = [], []
    for _ in range(n):
        sent.append(rng.bytes(size))
        burst = transmitter.modulate(sent[-1:], mcs)
        pause = silence(int(rng.integers(0, 600)))
        x = turned(burst, rng.uniform(-max_frequency, max_frequency), rng.random())
        events += receiver.push(noisy(rng, np.concatenate((pause, x)), snr_db))
    got = heard(events + receiver.flush())
    assert len(got) == len(set(got))
    assert set(got) <= set(sent)
    return n - len(got)


@pytest.mark.soak
def test_qpsk_half_of_220_bytes_at_6_db_loses_one_in_a_hundred_at_most():
    assert n_lost(often(1000), mcs=1, size=220, snr_db=6) <= at_most(10)


@pytest.mark.soak
@pytest.mark.parametrize(
    ("mcs", "size", "snr_db", "most"),
    [
        (0, 64, -1.6, 12),
        (0, 220, -1.6, 9),
        (1, 220, 1.1, 9),
        (1, 220, 1.7, 3),
        (2, 220, 4.3, 9),
        (3, 220, 6.5, 9),
        (3, 220, 7.2, 3),
        (4, 220, 10.4, 9),
        (5, 220, 14.5, 9),
        (6, 220, 15.9, 9),
        (6, 220, 16.8, 3),
        (9, 220, 23.3, 9),
    ],
)
def test_of_300_bursts_near_the_knee_few_are_lost(mcs, size, snr_db, most):
    """At each lower SNR one or two percent are lost; with 1 dB less it would exceed `most`.

    A third of the bursts notices a loss of 2 dB.
    """
    assert n_lost(often(300), mcs, size, snr_db) <= at_most(most)


@pytest.mark.parametrize(("mcs", "size", "snr_db"), [(0, 64, -4.0), (1, 220, -1.5), (6, 220, 13.0)])
def test_the_yardstick_tells_noise_from_signal(mcs, size, snr_db):
    """The control: 3 dB below the knee, most bursts are lost."""
    assert n_lost(50, mcs, size, snr_db) > 25


@pytest.mark.soak
def test_a_wide_search_for_the_carrier_costs_little():
    """±96 kHz at 1 Msps: five times as many hypotheses."""
    n = often(300)
    assert n_lost(n, mcs=1, size=220, snr_db=1.5, max_frequency=0.096) <= at_most(9)


@pytest.mark.soak
def test_preambles_are_found_below_the_noise():
    """Headers at -2 dB: everything depends on them, so they must fail last."""
    rng = np.random.default_rng(SEED)
    receiver, n_found = Receiver(), 0
    for _ in range(often(200)):
        burst = turned(Transmitter().modulate([bytes(9)], 0), rng.uniform(-0.02, 0.02))
        events = receiver.push(noisy(rng, np.concatenate((silence(500), burst)), -2))
        n_found += sum(isinstance(event, BurstOver) for event in events)
    assert n_found > 0.9 * often(200)


networks = pytest.mark.parametrize("network", [0, None])


@pytest.mark.soak
@networks
def test_nothing_is_heard_in_noise(network):
    rng = np.random.default_rng(SEED)
    for _ in range(often(1)):
        counters = quiet(noise(rng, 2_000_000), network)
        assert counters["samples"] == 2_000_000
        assert counters["triggers"] < 100
        assert counters["preambles"] == counters["bursts"] == 0


@networks
def test_nothing_is_heard_in_silence(network):
    counters = quiet(silence(2_000_000), network)
    assert counters["triggers"] == 0


@networks
@pytest.mark.parametrize("name", FOREIGN)
def test_nothing_of_ours_is_heard_in_what_others_send(name, network):
    """Wi-Fi has the same long training, but its short training lacks our code."""
    counters = quiet(FOREIGN[name](np.random.default_rng(SEED)), network)
    assert counters["triggers"] > 0 or not name.startswith("wifi")
    assert counters["preambles"] == counters["headers_bad"] == 0
    assert counters["bursts"] == counters["bursts_foreign"] == 0
