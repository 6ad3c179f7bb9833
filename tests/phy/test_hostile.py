"""Arbitrary samples: nothing is heard in them, and bursts after them are."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import Receiver, Transmitter
from tests.laws import law
from tests.phy.signals import hear, heard, noise, noisy, payloads, silence, turned

SEED = 37
N = 20_000

BAD = (np.nan, np.inf, -np.inf, 1e30, 3e38, 1e7)


def nasty():
    """Streams of `N` samples by name, with the number of non-finite ones."""
    rng = np.random.default_rng(SEED)
    gauss = noise(rng, N)
    signs = np.sign(gauss.real) + 1j * np.sign(gauss.imag)
    half = gauss.copy()
    half.imag = np.inf
    return {
        "silence": (silence(N), 0),
        "not numbers": (np.full(N, complex(np.nan, np.nan)), N),
        "half not numbers": (half, N),
        "1e30": (1e30 * gauss, N),
        "a level": (np.full(N, 1 + 1j), 0),
        "a subcarrier": (turned(np.ones(N), 0.013), 0),
        "a subcarrier of the segments": (turned(np.ones(N), 1 / 16), 0),
        "what repeats every 16": (np.resize(gauss[:16], N), 0),
        "what repeats every 64": (np.resize(gauss[:64], N), 0),
        "saturated": (signs, 0),
        "as small as can be": (1e-38 * gauss, 0),
        "very small": (1e-22 * gauss, 0),
        "large": (1e3 * gauss, 0),
        "every 97th no number": (np.where(np.arange(N) % 97, gauss, np.nan), 207),
    }


@pytest.mark.parametrize("name", nasty())
@pytest.mark.parametrize("max_frequency", [0.02, 0.1])
def test_nothing_is_heard_and_the_next_burst_is(name, max_frequency):
    rng = np.random.default_rng(SEED)
    samples, n_bad = nasty()[name]
    pdus = payloads(rng, 3, 100)
    receiver = Receiver(max_frequency=max_frequency)
    with np.errstate(over="raise", divide="raise", invalid="raise"):
        assert receiver.push(samples.astype(np.complex64)) == []
        # Its DC estimate must decay before a burst a thousand times weaker is heard.
        receiver.push(noise(rng, 200_000, 1e-3))
        events = receiver.push(noisy(rng, Transmitter().modulate(pdus, 1), 30)) + receiver.flush()
    assert heard(events) == pdus
    assert receiver.counters["samples_bad"] == n_bad
    assert np.isfinite(events[-1].burst[5:]).all()


@pytest.mark.parametrize("bad", BAD)
def test_a_few_samples_that_are_no_numbers_cost_their_own_symbol_at_most(bad):
    """They count as 0, so that a strong code tolerates them."""
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 3, 100)
    burst = Transmitter().modulate(pdus, 1)
    burst[700], burst[1500], burst[2400] = complex(bad, 0.5), complex(0.5, bad), complex(bad, bad)
    events, counters = hear(np.concatenate((silence(600), burst)))
    assert heard(events) == pdus
    assert counters["samples_bad"] == 3


@pytest.mark.parametrize("gain_db", [-120, -60, 0, 60, 100])
def test_a_burst_of_any_strength_is_heard(gain_db):
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 3, 100)
    x = np.concatenate((silence(600), Transmitter().modulate(pdus, 5)))
    events, _ = hear(10 ** (gain_db / 20) * noisy(rng, x, 30))
    assert heard(events) == pdus
    assert events[-1].burst.rssi_dbfs == pytest.approx(gain_db, abs=0.5)


def test_a_clipped_burst_is_heard():
    rng = np.random.default_rng(SEED)
    pdus = payloads(rng, 3, 100)
    x = noisy(rng, np.concatenate((silence(600), Transmitter().modulate(pdus, 1))), 30)
    clipped = np.clip(x.real, -0.7, 0.7) + 1j * np.clip(x.imag, -0.7, 0.7)
    assert heard(hear(clipped.astype(np.complex64))[0]) == pdus


@law(60)
@given(st.data())
def test_anything_may_come_between_bursts(data):
    """Pieces of bursts, noise, levels, non-finite values: no crash, and no PDU that nobody sent."""
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    sent, receiver = set(), Receiver(network=None, max_frequency=0.1)
    events = []
    for _ in range(data.draw(st.integers(1, 6))):
        kind = data.draw(st.sampled_from(["burst", "noise", "level", "bad", "gap", "silence"]))
        n = data.draw(st.integers(0, 2000))
        if kind == "gap":
            events += receiver.gap(n)
            continue
        pdus = payloads(rng, int(rng.integers(1, 5)), int(rng.integers(4, 80)))
        sent |= set(pdus)
        mcs, network = int(rng.integers(7)), int(rng.integers(8))
        burst = Transmitter(network).modulate(pdus, mcs)
        part = {
            "burst": turned(burst[data.draw(st.integers(0, 600)) :], rng.uniform(-0.1, 0.1)),
            "noise": noise(rng, n, 10 ** rng.uniform(-4, 4)),
            "level": np.full(n, 10 ** rng.uniform(-3, 3), np.complex64),
            "bad": np.full(n, rng.choice(BAD)).astype(np.complex64),
            "silence": silence(n),
        }[kind]
        events += receiver.push(part)
    events += receiver.flush()
    assert set(heard(events)) <= sent
    before = receiver.counters["pdus_good"]
    receiver.gap(0)
    receiver.push(silence(200_000))
    burst = Transmitter(4).modulate([b"after all that"], 1)
    assert heard(receiver.push(np.concatenate((burst, silence(3000))))) == [b"after all that"]
    assert receiver.counters["pdus_good"] == before + 1
