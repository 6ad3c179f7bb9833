"""Bugs that were fixed."""

import numpy as np
import pytest

from phy import OFDM_64_16, Path, PathParams, Receiver, Transmitter, layout
from phy.testing import BurstHeader, header_samples, preamble
from tests.phy.signals import hear, heard, noise, noisy, payloads, silence, turned


def events_in_chunks(x, size):
    receiver = Receiver()
    events = []
    for at in range(0, len(x), size):
        events += receiver.push(x[at : at + size])
    return events + receiver.flush()


@pytest.mark.parametrize(("seed", "mcs", "snr_db"), [(1621, 6, 14.5), (22575, 5, 13.5)])
def test_chunking_does_not_decide_a_pdu_at_the_edge(seed, mcs, snr_db):
    rng = np.random.default_rng(seed)
    pdus = payloads(rng, 60, 20)
    x = np.concatenate([silence(600), Transmitter().modulate(pdus, mcs), silence(900)])
    x = noisy(rng, turned(x, rng.uniform(-0.018, 0.018)), snr_db)
    assert events_in_chunks(x, 300) == events_in_chunks(x, len(x))


def test_points_are_the_same_to_the_last_bit_for_any_chunking():
    rng = np.random.default_rng(1)
    x = np.concatenate([silence(600), Transmitter().modulate(payloads(rng, 20, 60), 6)])
    x = noisy(rng, turned(x, 0.0123), 25)
    seen = {}
    for size in (len(x), 300):
        parts = []
        receiver = Receiver(on_points=lambda points, _, parts=parts: parts.append(points.copy()))
        for at in range(0, len(x), size):
            receiver.push(x[at : at + size])
        receiver.flush()
        seen[size] = np.concatenate(parts)
    assert np.array_equal(*seen.values())


def test_a_faster_crystal_raises_the_carrier_and_shortens_the_burst():
    """The sender's clock against the receiver's; one crystal drives carrier and samples."""
    n = 100_000
    burst = turned(np.ones(n), 0.01)
    params = PathParams(rate_hz=1e6, centre_hz=0.0, clock_ppm=100)
    _, y = Path(params, np.random.default_rng(0)).carry(burst)
    inner = y[100 : n - 200]
    frequency = np.angle(np.vdot(inner[:-1], inner[1:])) / (2 * np.pi)
    assert frequency == pytest.approx(0.01 * (1 + 100e-6), abs=1e-7)


@pytest.mark.parametrize("mcs", [1, 3, 6])
@pytest.mark.parametrize("power", [1, 100])
def test_interference_during_one_pdu_costs_that_pdu_only(mcs, power):
    rng = np.random.default_rng(3)
    plan = layout(OFDM_64_16, mcs, 6, 220)
    n_all = 0
    for _ in range(30):
        pdus = payloads(rng, 6, 220)
        x = np.concatenate((silence(700), Transmitter().modulate(pdus, mcs)))
        first, last = (
            700 + 512 + 80 * s for s in (plan.symbols_through(2), plan.symbols_through(3) - 1)
        )
        x[first:last] += noise(rng, last - first, power)
        got = heard(hear(noisy(rng, x, 25))[0])
        n_all += got == pdus[:2] + pdus[3:]
    assert n_all >= 28


@pytest.mark.parametrize("network", [0, 3])
def test_a_header_with_nothing_behind_it_does_not_make_deaf_for_seconds(network):
    rng = np.random.default_rng(3)
    sent = header_samples(BurstHeader(0, 63, 2047, network), OFDM_64_16)
    lie = np.concatenate((preamble.preamble(), sent))
    pdus = payloads(rng, 2, 60)
    x = np.concatenate((silence(700), lie, silence(60_000), Transmitter().modulate(pdus, 1)))
    assert heard(hear(noisy(rng, x, 20))[0]) == pdus


@pytest.mark.parametrize("max_frequency", [1 / 32, 0.0312, 3 / 32])
def test_the_largest_frequency_asked_for_is_reached(max_frequency):
    rng = np.random.default_rng(3)
    n = 0
    for _ in range(50):
        x = np.concatenate((silence(500), Transmitter().modulate([bytes(32)], 0), silence(500)))
        n += len(
            heard(hear(noisy(rng, turned(x, max_frequency), 10), max_frequency=max_frequency)[0])
        )
    assert n == 50


@pytest.mark.parametrize("ppm", [-40, 40])
@pytest.mark.parametrize(("mcs", "n_pdus", "size"), [(1, 63, 220), (3, 30, 1000), (6, 63, 2047)])
def test_clocks_apart_by_40_ppm_in_the_longest_bursts(mcs, n_pdus, size, ppm):
    rng = np.random.default_rng(3)
    pdus = payloads(rng, n_pdus, size)
    params = PathParams(rate_hz=1e6, clock_ppm=ppm)
    _, y = Path(params, rng).carry(Transmitter().modulate(pdus, mcs))
    assert heard(hear(noisy(rng, np.concatenate((silence(700), y)), 30))[0]) == pdus
