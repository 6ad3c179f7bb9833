"""Neighbors that send all the time, and clocks that do or do not follow the centre frequency."""

import numpy as np
import pytest

from benchmarks.phy_speed import gfsk
from phy import Path, PathParams, Receiver, Transmitter
from tests.phy.signals import heard, noise, noisy, payloads, silence, turned

SEED = 71


@pytest.mark.parametrize("samples_a_bit", [4, 8, 20])
def test_a_neighbour_20_db_over_the_noise_is_looked_at_rarely(samples_a_bit):
    rng = np.random.default_rng(SEED)
    n = 500_000
    receiver = Receiver()
    assert receiver.push(10 * gfsk(rng, n, samples_a_bit) + noise(rng, n)) == []
    assert receiver.counters["triggers"] < 2500e-6 * n
    assert receiver.counters["bursts"] == 0


@pytest.mark.parametrize("samples_a_bit", [4, 20])
def test_a_burst_8_db_over_such_a_neighbour_is_heard(samples_a_bit):
    rng = np.random.default_rng(SEED)
    receiver, sent, events = Receiver(), [], []
    for _ in range(30):
        sent += payloads(rng, 1, 60)
        burst = turned(Transmitter().modulate(sent[-1:], 0), rng.uniform(-0.01, 0.01))
        x = np.concatenate((silence(4000), 10 * 10**0.4 * burst))
        events += receiver.push(x + 10 * gfsk(rng, len(x), samples_a_bit) + noise(rng, len(x)))
    assert len(heard(events + receiver.flush())) >= 27


def test_when_the_neighbour_is_gone_weak_bursts_are_found_as_before():
    rng = np.random.default_rng(SEED)
    n, found = 40, {}
    for is_jammed in (False, True):
        receiver = Receiver()
        if is_jammed:
            receiver.push(10 * gfsk(rng, 100_000, 4) + noise(rng, 100_000))
            # Five times the period in which the threshold decays by a factor of e.
            receiver.push(noise(rng, 5 * 4096))
        before = receiver.counters["preambles"]
        for _ in range(n):
            burst = turned(Transmitter().modulate([bytes(20)], 0), rng.uniform(-0.02, 0.02))
            receiver.push(noisy(rng, np.concatenate((silence(500), burst)), -2))
        receiver.flush()
        found[is_jammed] = receiver.counters["preambles"] - before
    assert found[True] >= found[False] - 2 >= n - 4


def n_lost_of_20(ppm, one_crystal, snr_db):
    """Number of 20 long bursts that are lost with a frequency error of `ppm`.

    With one crystal the sample rate has the same error. The receiver always assumes one crystal.
    """
    rng, centre_hz, rate_hz = np.random.default_rng(SEED), 2.4e9, 5e6
    params = PathParams(rate_hz, centre_hz if one_crystal else 0.0, clock_ppm=ppm * one_crystal)
    n_lost = 0
    for _ in range(20):
        pdu = rng.bytes(1500)
        _, x = Path(params, rng).carry(Transmitter().modulate([pdu], 1))
        if not one_crystal:
            x = turned(x, centre_hz * ppm * 1e-6 / rate_hz)
        receiver = Receiver(max_frequency=0.03, centre_cycles=centre_hz / rate_hz)
        events = receiver.push(noisy(rng, np.concatenate((silence(400), x)), snr_db))
        n_lost += heard(events + receiver.flush()) != [pdu]
    return n_lost


@pytest.mark.parametrize("ppm", [-40, 40])
def test_one_crystal_tells_the_clock_from_the_carrier(ppm):
    assert n_lost_of_20(ppm, one_crystal=True, snr_db=1.8) <= 1


@pytest.mark.parametrize("ppm", [-20, 20])
def test_pilots_contradict_a_carrier_that_tells_nothing(ppm):
    assert n_lost_of_20(ppm, one_crystal=False, snr_db=8.0) <= 1
