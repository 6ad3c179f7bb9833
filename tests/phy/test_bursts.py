"""Streams of several bursts, and bursts that are cut or disturbed."""

import numpy as np
import pytest

from phy import COUNTERS, OFDM_64_16, Receiver, Transmitter, layout
from phy.testing import BurstHeader, header_samples, preamble
from tests.phy.signals import (
    endings,
    hear,
    heard,
    noise,
    noisy,
    payloads,
    silence,
    turned,
)

SEED = 31
LEAD = 700
SNR_DB = 25


def stream(*parts, seed=SEED):
    """Bursts and pauses (numbers) in noise."""
    samples = [silence(part) if isinstance(part, int) else part for part in parts]
    return noisy(np.random.default_rng(seed), np.concatenate(samples), SNR_DB)


def a_burst(rng, mcs=1, n_pdus=3, size=100, network=0):
    pdus = payloads(rng, n_pdus, size)
    return pdus, Transmitter(network).modulate(pdus, mcs)


def opening(header):
    """Preamble and header alone, whatever the header says."""
    return np.concatenate((preamble.preamble(), header_samples(header, OFDM_64_16)))


@pytest.mark.parametrize("pause", [0, 1, 7, 15, 200])
def test_bursts_without_a_pause_are_all_heard(pause):
    rng = np.random.default_rng(SEED)
    parts, pdus = [LEAD], []
    for mcs in (0, 6, 1, 3, 5, 2, 4):
        sent, burst = a_burst(rng, mcs, n_pdus=int(rng.integers(1, 6)))
        pdus += sent
        # Every sender has its own frequency offset.
        parts += [turned(burst, rng.uniform(-0.015, 0.015), rng.random()), pause]
    events, counters = hear(stream(*parts))
    assert heard(events) == pdus
    assert endings(events) == ["whole"] * 7
    assert counters["bursts"] == counters["preambles"] == 7


def test_a_burst_from_the_very_first_sample_to_the_very_last():
    pdus, burst = a_burst(np.random.default_rng(SEED))
    assert heard(hear(burst)[0]) == pdus


def test_bursts_of_different_strength_follow_one_another():
    rng = np.random.default_rng(SEED)
    loud, quiet, again = (a_burst(rng) for _ in range(3))
    events, _ = hear(stream(LEAD, 30 * loud[1], 0, quiet[1], 0, 30 * again[1]))
    assert heard(events) == loud[0] + quiet[0] + again[0]


def test_another_networks_burst_is_skipped_and_counted():
    rng = np.random.default_rng(SEED)
    ours, ours_again = (a_burst(rng, network=2) for _ in range(2))
    theirs, burst = a_burst(rng, network=5)
    samples = stream(LEAD, ours[1], burst, ours_again[1])
    events, counters = hear(samples, network=2)
    assert heard(events) == ours[0] + ours_again[0]
    assert endings(events) == ["whole", "foreign", "whole"]
    foreign = events[4]
    assert (foreign.n_good, foreign.burst.network) == (0, 5)
    assert (counters["bursts"], counters["bursts_foreign"]) == (2, 1)
    assert counters["pdus_bad"] == 0
    assert heard(hear(samples, network=None)[0]) == ours[0] + theirs + ours_again[0]


def test_a_gap_cuts_a_burst_and_the_next_is_found():
    rng = np.random.default_rng(SEED)
    first, burst = a_burst(rng)
    second, burst_2 = a_burst(rng)
    receiver = Receiver()
    events = receiver.push(stream(LEAD, burst[:2500]))
    assert heard(events) == first[:1]
    cut = receiver.gap(400)
    assert [(each.n_good, each.ending) for each in cut] == [(1, "cut")]
    assert receiver.next_index == LEAD + 2500 + 400
    events = receiver.push(stream(burst_2)) + receiver.flush()
    assert heard(events) == second
    assert events[0].burst.start == pytest.approx(LEAD + 2900, abs=1)
    assert (receiver.counters["gaps"], receiver.counters["bursts_cut"]) == (1, 1)
    assert receiver.counters["samples"] == LEAD + 2500 + len(burst_2)


def test_a_gap_inside_a_preamble_or_a_header_loses_that_burst_only():
    for cut in (50, 190, 300, 400, 500):
        rng = np.random.default_rng(SEED)
        _, burst = a_burst(rng)
        pdus, burst_2 = a_burst(rng)
        receiver = Receiver()
        events = receiver.push(stream(LEAD, burst[:cut]))
        assert events == []
        # From half a header on, the receiver may know of the burst.
        assert [each.n_good for each in receiver.gap(10)] in ([], [0])
        assert heard(receiver.push(stream(100, burst_2)) + receiver.flush()) == pdus


def test_gaps_one_after_another_and_of_nothing():
    receiver = Receiver()
    for n in (0, 5, 0, 1000):
        assert receiver.gap(n) == []
    assert receiver.next_index == 1005
    pdus, burst = a_burst(np.random.default_rng(SEED))
    events = receiver.push(burst) + receiver.flush()
    assert heard(events) == pdus
    assert events[0].burst.start == 1005


@pytest.mark.parametrize("mcs", [0, 1, 3, 6])
def test_a_burst_that_stops_has_faded_and_the_next_is_found(mcs):
    rng = np.random.default_rng(SEED)
    first, burst = a_burst(rng, mcs, n_pdus=40)
    end = 352 + 80 * (2 + layout(OFDM_64_16, mcs, 40, 100).symbols_through(3)) + 30
    second, burst_2 = a_burst(rng, mcs)
    # The PDU after the last good one fails, and at worst one more.
    pause = 2 * layout(OFDM_64_16, mcs, 1, 100).n_samples
    events, counters = hear(stream(LEAD, burst[:end], pause, burst_2))
    assert heard(events) == first[:3] + second
    assert endings(events) == ["faded", "whole"]
    assert counters["bursts_faded"] == 1
    assert 1 <= counters["pdus_bad"] <= 2


def test_a_pdu_with_wrong_bits_fails_alone():
    """Half of its symbols are from another burst; its framing is intact."""
    rng = np.random.default_rng(SEED)
    pdus, burst = a_burst(rng, n_pdus=6)
    _, other = a_burst(rng, n_pdus=6)
    plan = layout(OFDM_64_16, 1, 6, 100)
    inside = slice(512 + 80 * plan.symbols_through(2), 512 + 80 * (plan.symbols_through(2) + 8))
    burst[inside] = other[inside]
    events, counters = hear(stream(LEAD, burst))
    assert heard(events) == pdus[:2] + pdus[3:]
    assert [event.number for event in events[:-1]] == [0, 1, 3, 4, 5]
    assert (events[-1].n_good, events[-1].ending) == (5, "whole")
    assert (counters["pdus_good"], counters["pdus_bad"]) == (5, 1)


@pytest.mark.parametrize(
    "header",
    [BurstHeader(0, 63, 2047, 0), BurstHeader(6, 63, 100, 0), BurstHeader(3, 1, 1, 0)],
)
def test_a_header_with_nothing_behind_it_holds_nobody_up_for_longer_than_a_pdu(header):
    rng = np.random.default_rng(SEED)
    pdus, burst = a_burst(rng)
    one_pdu = layout(OFDM_64_16, header.mcs, 1, header.pdu_bytes).n_samples
    events, counters = hear(stream(LEAD, opening(header), one_pdu, burst))
    assert heard(events) == pdus
    assert endings(events) == ["whole" if header.n_pdus == 1 else "faded", "whole"]
    assert (events[0].n_good, counters["pdus_bad"]) == (0, 1)


@pytest.mark.parametrize("header", [BurstHeader(10, 1, 1, 0), BurstHeader(0, 0, 9, 0)])
def test_a_header_that_makes_no_sense_is_counted(header):
    pdus, burst = a_burst(np.random.default_rng(SEED))
    events, counters = hear(stream(LEAD, opening(header), burst))
    assert heard(events) == pdus
    assert (counters["headers_bad"], counters["preambles"], counters["bursts"]) == (1, 2, 1)


def test_false_starts_are_no_bursts():
    """Short training without the long, a preamble without a header."""
    pdus, burst = a_burst(np.random.default_rng(SEED))
    start = preamble.preamble()
    events, counters = hear(stream(LEAD, start[:192], 500, start, 500, burst))
    assert heard(events) == pdus
    assert counters["bursts"] == 1
    assert counters["headers_bad"] >= 1
    assert counters["triggers"] >= 3


@pytest.mark.parametrize("distance", [100, 300, 1500])
@pytest.mark.parametrize("loud", [0, 1])
def test_of_two_bursts_at_once_the_louder_is_heard(distance, loud):
    rng = np.random.default_rng(SEED)
    both = [a_burst(rng) for _ in range(2)]
    later, burst = a_burst(rng)
    x = silence(9000)
    for i, (_, samples) in enumerate(both):
        at = LEAD + i * distance
        x[at : at + len(samples)] += samples if i == loud else 0.1 * samples
    events, counters = hear(stream(x, burst))
    assert heard(events)[-3:] == later
    assert counters["pdus_good"] == len(heard(events))
    # So is what the other one said before.
    before = both[0][0][:1] if loud == 1 and distance > 350 else []
    assert heard(events) == before + both[loud][0] + later


def test_two_equal_bursts_at_once_destroy_nothing_else():
    """One of them may be heard."""
    rng = np.random.default_rng(SEED)
    both = [a_burst(rng) for _ in range(2)]
    pdus, burst = a_burst(rng)
    x = silence(9000)
    for at, (_, samples) in zip((LEAD, LEAD + 1000), both, strict=True):
        x[at : at + len(samples)] += samples
    events, _ = hear(stream(x, burst))
    assert heard(events)[-len(pdus) :] == pdus
    assert set(heard(events)) <= {*pdus, *(pdu for each, _ in both for pdu in each)}


def test_flush_finishes_the_last_burst_and_may_be_repeated():
    pdus, burst = a_burst(np.random.default_rng(SEED))
    receiver = Receiver()
    first = receiver.push(stream(LEAD, burst[:-60]))
    assert heard(first) == pdus[:2]
    last = receiver.flush()
    assert endings(last) == ["whole"]
    assert receiver.counters["samples"] == LEAD + len(burst) - 60
    assert receiver.flush() == []


def test_flush_cuts_a_burst_that_lacks_more():
    pdus, burst = a_burst(np.random.default_rng(SEED), n_pdus=40)
    receiver = Receiver()
    receiver.push(stream(LEAD, burst[:6000]))
    assert endings(receiver.flush()) in (["cut"], ["faded"])
    assert heard(receiver.push(stream(LEAD, burst)) + receiver.flush()) == pdus


def test_only_known_names_are_counted_and_all_grow():
    rng = np.random.default_rng(SEED)
    receiver = Receiver()
    before = dict.fromkeys(COUNTERS, 0)
    for _ in range(5):
        _, burst = a_burst(rng, network=int(rng.integers(2)))
        receiver.push(stream(LEAD, burst[: int(rng.integers(300, len(burst)))]))
        receiver.push(noise(rng, 500))
        receiver.gap(3)
        after = {name: receiver.counters[name] for name in COUNTERS}
        assert all(after[name] >= before[name] for name in COUNTERS)
        before = after
    assert set(receiver.counters) <= set(COUNTERS)
