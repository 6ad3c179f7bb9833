"""Pulses of energy: a detector finds them wherever they begin, and a receiver ignores them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import N_PULSE, EnergyDetector, Receiver, Transmitter, pulse
from phy import SENSE_WINDOW as WINDOW
from tests.laws import law
from tests.phy.signals import noise, noisy, payloads, silence, turned

REST = 40 * WINDOW


def rng(seed=7):
    return np.random.default_rng(seed)


def test_its_level_is_constant_and_it_fills_the_band():
    samples = pulse()
    assert samples.shape == (N_PULSE,)
    levels = np.abs(samples[8:-8])
    assert levels == pytest.approx(np.ones(len(levels)), abs=1e-4)
    spectrum = np.abs(np.fft.fft(samples * np.hanning(N_PULSE))) ** 2
    assert np.count_nonzero(spectrum > 0.05 * spectrum.max()) > N_PULSE / 3


@law()
@given(st.integers(0, 3 * WINDOW), st.integers(1, 400), st.integers(0, 10**6))
def test_it_is_found_once_wherever_it_begins_and_however_it_comes(offset, chunk, seed):
    draws = rng(seed)
    x = np.concatenate((silence(REST + offset), pulse(), silence(REST), pulse(), silence(REST)))
    x = noisy(draws, turned(x, draws.uniform(-0.01, 0.01), draws.random()), 12)
    sense = EnergyDetector()
    for at in range(0, len(x), chunk):
        sense.push(x[at : at + chunk])
    begins = [REST + offset, 2 * REST + offset + N_PULSE]
    assert len(sense.pulses()) == 2
    assert all(
        abs(found - begin) < WINDOW for found, begin in zip(sense.pulses(), begins, strict=True)
    )
    assert sense.carrier_until == 0


def test_a_burst_is_a_carrier_and_no_pulse():
    draws = rng()
    burst = Transmitter().modulate(payloads(draws, 3, 220), 1)
    x = noisy(draws, np.concatenate((silence(REST), burst, silence(REST))), 15)
    sense = EnergyDetector()
    sense.push(x)
    assert sense.pulses() == []
    assert sense.carrier_until == sense.busy_until
    assert abs(sense.carrier_until - REST - len(burst)) < 2 * WINDOW


@pytest.mark.parametrize("chunk", [1, 40, 64, 100])
def test_a_burst_that_begins_is_never_taken_for_a_pulse(chunk):
    draws = rng()
    burst = Transmitter().modulate(payloads(draws, 3, 220), 1)
    x = noisy(draws, np.concatenate((silence(REST), burst[:2000])), 15)
    sense = EnergyDetector()
    for at in range(0, len(x), chunk):
        sense.push(x[at : at + chunk])
        assert sense.pulses() == []
    assert sense.carrier_until > REST


@pytest.mark.parametrize("apart", [0, 50, 128, 300])
def test_pulses_of_two_robots_in_one_mini_slot_are_one(apart):
    """Their clocks drift while nobody sends."""
    draws = rng()
    x = np.zeros(2 * REST + N_PULSE + apart, np.complex64)
    x[REST : REST + N_PULSE] += pulse()
    x[REST + apart : REST + apart + N_PULSE] += pulse() * np.exp(1j)
    sense = EnergyDetector()
    sense.push(noisy(draws, x, 15))
    (found,) = sense.pulses()
    assert abs(found - REST) < WINDOW
    assert sense.carrier_until == 0


def test_they_are_heard_from_7_db_on():
    """As the documents say; a burst of MCS 0 is read below that."""
    draws, sense, n = rng(), EnergyDetector(), 1000
    sense.push(noise(draws, 100 * WINDOW))
    n_heard = 0
    for _ in range(n):
        begin = sense.next_index
        x = np.concatenate((silence(int(draws.integers(0, WINDOW))), pulse(), silence(REST)))
        sense.push(noisy(draws, x, 7))
        n_heard += len(sense.pulses(begin - WINDOW)) == 1
    assert n_heard >= 0.999 * n


def test_noise_alone_has_none():
    sense = EnergyDetector()
    sense.push(noise(rng(), 2_000_000))
    assert sense.pulses() == []


def test_only_the_last_ones_are_kept():
    draws, sense = rng(), EnergyDetector()
    for _ in range(40):
        sense.push(noisy(draws, np.concatenate((silence(REST), pulse(), silence(REST))), 15))
    step = 2 * REST + N_PULSE
    assert [round(each / step - 0.5) for each in sense.pulses()] == list(range(23, 40)), (
        "16, and the last one"
    )


def test_a_receiver_makes_nothing_of_it():
    draws, receiver = rng(), Receiver()
    for _ in range(50):
        gap = silence(int(draws.integers(200, 3000)))
        sent = turned(np.concatenate((gap, pulse())), draws.uniform(-0.02, 0.02), draws.random())
        assert not list(receiver.push(noisy(draws, sent, 25)))
    assert receiver.claim[0] <= 0
