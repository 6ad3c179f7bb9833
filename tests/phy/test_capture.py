"""A burst that begins inside another one: both are received, as far as they can be."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import BurstOver, Expected, PduHeard, Receiver, Transmitter, reference
from tests.laws import law
from tests.phy.chunks import chunk_sizes, push_all
from tests.phy.signals import endings, heard, noisy, payloads, silence, turned

SIZE = 100
HEADER = 512
"""Samples of preamble and header, about."""


@pytest.fixture
def rng():
    return np.random.default_rng(471)


def bursts_at(rng, *bursts, snr_db=25):
    """Samples with bursts, each an (index, amplitude, samples), in noise."""
    x = silence(max(at + len(samples) for at, _, samples in bursts) + 1500)
    for at, amplitude, samples in bursts:
        x[at : at + len(samples)] += amplitude * turned(samples, rng.uniform(-0.01, 0.01), 0.3)
    return noisy(rng, x, snr_db)


def received(x, kind=Receiver, **settings):
    receiver = kind(**settings)
    return receiver.push(x) + receiver.flush(), receiver.counters


@pytest.mark.parametrize("kind", [Receiver, reference.Receiver], ids=["ours", "reference"])
@pytest.mark.parametrize(("mcs", "louder_db"), [(1, 6), (1, 20), (6, 25)])
def test_a_louder_burst_is_heard_and_so_is_what_it_left_of_the_other(rng, kind, mcs, louder_db):
    # By MCS 6, the first has to be long to outlast it.
    n = 5 if mcs == 1 else 16
    one, other = payloads(rng, n, SIZE), payloads(rng, 1, SIZE)
    first, second = (Transmitter().modulate(each, mcs) for each in (one, other))
    for at in (HEADER + 100, len(first) // 3, len(first) - 300):
        x = bursts_at(rng, (800, 1, first), (800 + at, 10 ** (louder_db / 20), second))
        events, counters = received(x, kind)
        got = heard(events)
        assert other[0] in got
        n_hit = -(-len(second) * n // (len(first) - HEADER)) + 1
        assert len(set(one) & set(got)) >= n - n_hit
        assert counters["captures"] == (at < len(first) - 512)
        assert set(endings(events)) == {"whole"}


def test_a_burst_right_behind_one_that_stopped_is_heard(rng):
    """At any place in a symbol, a PDU and the code's last bits, which need not be heard."""
    one, other = payloads(rng, 2, SIZE), payloads(rng, 1, SIZE)
    first, second = (Transmitter().modulate(each, 1) for each in (one, other))
    cuts = range(HEADER + 100, len(first), 37)
    missed = 0
    for cut in cuts:
        x = noisy(rng, np.concatenate((silence(800), first[:cut], second, silence(1500))), 25)
        missed += other[0] not in heard(received(x)[0])
    assert missed <= 0.03 * len(cuts)


@pytest.mark.parametrize("mcs", [0, 1, 6, 9])
@pytest.mark.parametrize("n_bytes", [16, 400])
def test_no_sample_of_a_good_burst_is_searched_again(rng, mcs, n_bytes):
    pdus = payloads(rng, 6, n_bytes)
    burst = Transmitter().modulate(pdus, mcs)
    x = noisy(rng, np.concatenate([silence(900), burst] * 5 + [silence(1500)]), 35)
    events, counters = received(x)
    assert heard(events) == pdus * 5
    assert not counters["samples_searched_again"]


@pytest.mark.parametrize("promise_db", [-10, 0, 6])
def test_a_flood_of_headers_is_no_denial(rng, promise_db):
    """Valid headers of our own network and length promise long bursts, in bursts and in pauses.

    What they lie on is lost if they are loud. Everything else is heard.
    """
    expected = Expected(SIZE, longest=20_000, every=10_000)
    promise = Transmitter().modulate(payloads(rng, 8, SIZE), 1)[: HEADER + 64]
    x, spared, at = silence(600_000), [], 1000
    while at < len(x) - 20_000:
        pdus = payloads(rng, 6, SIZE)
        burst = Transmitter().modulate(pdus, 1)
        x[at : at + len(burst)] += burst
        ends = at + HEADER + (len(burst) - HEADER) / len(pdus) * np.arange(1, len(pdus) + 1)
        inside = at + int(rng.integers(HEADER + 200, len(burst) - len(promise)))
        behind = at + len(burst) + 40
        for place in (inside, behind):
            x[place : place + len(promise)] += np.float32(10 ** (promise_db / 20)) * promise
        is_spared = (ends < inside) | (np.r_[0, ends[:-1]] > inside + len(promise))
        spared += [pdu for pdu, whole in zip(pdus, is_spared, strict=True) if whole]
        at = behind + len(promise) + int(rng.integers(40, 900))
    events, counters = received(noisy(rng, x, 25), expected=expected)
    assert len(set(heard(events)) & set(spared)) >= 0.9 * len(spared)
    assert counters["captures"] > 10


def test_a_third_burst_takes_the_place_of_the_one_that_said_the_least(rng):
    first, second, third = ([b"%d%d" % (i, n) * 20 for n in range(8)] for i in range(3))
    waves = [Transmitter().modulate(pdus, 1) for pdus in (first, second, third)]
    half = (800 + len(waves[0]) // 2, 6, waves[1])
    x = bursts_at(rng, (800, 1, waves[0]), half, (half[0] + 1400, 40, waves[2]), snr_db=30)
    events, counters = received(x)
    assert counters["captures"] == 2
    over = [(event.n_good, event.ending) for event in events if isinstance(event, BurstOver)]
    assert [ending for _, ending in sorted(over)] == ["displaced", "whole", "whole"]
    assert counters["bursts_displaced"] == 1


@law(60)
@given(st.integers(0, 2**32), chunk_sizes)
def test_any_chunking_yields_the_same_events_and_counts(seed, sizes):
    rng = np.random.default_rng(seed)
    bursts, at = [], 700
    for _ in range(int(rng.integers(2, 6))):
        network = int(rng.random() < 0.2)
        pdus = payloads(rng, int(rng.integers(1, 9)), int(rng.integers(1, 120)))
        burst = Transmitter(network).modulate(pdus, int(rng.integers(0, 4)))
        if rng.random() < 0.3:
            burst = burst[: int(rng.integers(400, len(burst)))]
        bursts.append((at, 10 ** rng.uniform(-0.5, 1), burst))
        at += int(rng.integers(100, len(burst) + 600))
    x = bursts_at(rng, *bursts)
    whole, counted = received(x)
    receiver = Receiver()
    events = push_all(receiver, x, sizes) + receiver.flush()
    assert events == whole
    assert receiver.counters == counted
    n_good = sum(isinstance(event, PduHeard) for event in events)
    assert counted["bursts"] == len(endings(events)) - counted["bursts_foreign"]
    assert counted["pdus_good"] == n_good
