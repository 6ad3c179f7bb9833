"""False headers and floods of preambles: what a receiver refuses, and what that costs it."""

from math import inf

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import phy
from phy import Expected, PduHeard, reference
from phy.testing import preamble
from tests.laws import law

RATE = 1_000_000
SEED = 7
GRID = phy.OFDM_64_16
SIZE, N_PDUS, MCS = 256, 2, 3
# A header alone: preamble and header symbols.
ONE = phy.layout(GRID, MCS, 1, SIZE)
HEADER = ONE.n_samples - ONE.n_symbols * GRID.n_symbol
LONGEST = 5000
EXPECTED = Expected(SIZE, LONGEST, every=RATE // 1000)


def a_header(rng, size=2047, n_pdus=63, mcs=0, network=0):
    """The first 0.5 ms of a burst whose payload is never sent."""
    pdus = [rng.bytes(size) for _ in range(n_pdus)]
    return phy.Transmitter(network).modulate(pdus, mcs)[:HEADER]


def a_burst(rng, size=SIZE, n_pdus=N_PDUS, mcs=MCS, network=0):
    pdus = [rng.bytes(size) for _ in range(n_pdus)]
    return pdus, phy.Transmitter(network).modulate(pdus, mcs)


def noise(rng, n, snr_db=25):
    scale = 10 ** (-snr_db / 20) / np.sqrt(2)
    return (scale * (rng.normal(size=n) + 1j * rng.normal(size=n))).astype(np.complex64)


def an_air(rng, seconds, false, every):
    """(samples, PDUs sent): good bursts at random, and `false` each `every` samples.

    No false header lies on a good burst.
    """
    n = round(seconds * RATE)
    x, sent, at = noise(rng, n), [], 2000
    taken = [(first, first + len(false)) for first in range(1000, n - len(false), every)]
    for first, last in taken:
        x[first:last] += false
    while True:
        pdus, burst = a_burst(rng)
        while any(first < at + len(burst) + 64 and at < last + 64 for first, last in taken):
            at += 100
        if at + len(burst) > n:
            return x, sent
        x[at : at + len(burst)] += burst
        sent += pdus
        at += len(burst) + int(rng.integers(200, 3000))


def heard(receiver, x):
    events = receiver.push(x) + receiver.flush()
    return [event.data for event in events if isinstance(event, PduHeard)]


FALSE = {
    "another length, 7 s long": {},
    "our length, too long": {"size": SIZE, "n_pdus": 63},
    "another length, short": {"size": 100, "n_pdus": 1, "mcs": 5},
}


@pytest.mark.parametrize("name", FALSE)
def test_headers_that_this_link_never_sends_cost_nothing(name):
    rng = np.random.default_rng(1)
    x, sent = an_air(rng, 1.0, a_header(rng, **FALSE[name]), every=11_000)
    receiver = phy.Receiver(expected=EXPECTED)
    assert heard(receiver, x) == sent
    assert receiver.counters["headers_refused"] >= 85
    # Who believes them looks into what they claim, nevertheless.
    assert len(set(heard(phy.Receiver(), x)) & set(sent)) >= 0.9 * len(sent)


def test_the_claim_is_within_the_longest_burst_for_other_networks_too():
    rng = np.random.default_rng(2)
    header = a_header(rng, network=3)
    x = np.concatenate((noise(rng, 3000), header + noise(rng, HEADER), noise(rng, 3000)))
    receiver = phy.Receiver(expected=EXPECTED)
    receiver.push(x)
    start, end, snr_db = receiver.claim
    assert abs(start - 3000) <= 4
    assert end == start + LONGEST
    assert 22 < snr_db < 28
    assert receiver.counters["headers_refused"] == 0


def test_a_refused_header_claims_no_air():
    rng = np.random.default_rng(3)
    receiver = phy.Receiver(expected=EXPECTED)
    receiver.push(np.concatenate((noise(rng, 3000), a_header(rng), noise(rng, 3000))))
    assert receiver.claim == (0, 0, -inf)


def test_a_burst_whose_power_vanishes_claims_no_more():
    rng = np.random.default_rng(4)
    _, burst = a_burst(rng, n_pdus=4, mcs=1)
    parts = noise(rng, 3000), burst[: len(burst) // 2], noise(rng, len(burst))
    receiver = phy.Receiver(expected=Expected(SIZE, 20_000, 1000))
    receiver.push(np.concatenate(parts))
    assert receiver.counters["bursts_faded"] == 1
    assert receiver.claim.end < 3000 + 0.85 * len(burst)


def a_flood(rng, n):
    """Preambles whose header is noise, back to back, in a quarter of a second of air."""
    one = a_header(rng)
    one[preamble.length(GRID) :] = noise(rng, HEADER - preamble.length(GRID), 0)
    return (np.tile(one, n // HEADER) + noise(rng, n // HEADER * HEADER)).astype(np.complex64)


def test_a_flood_of_preambles_costs_no_more_than_its_budget():
    rng = np.random.default_rng(5)
    x = a_flood(rng, RATE // 2)
    spent = {}
    for expected in (None, EXPECTED._replace(every=RATE // 100, misses=10)):
        receiver = phy.Receiver(expected=expected)
        receiver.push(x)
        spent[expected] = receiver.counters["headers_bad"]
        assert (receiver.counters["peaks_skipped"] > 0) == (expected is not None)
    free, bounded = spent.values()
    assert free > 500
    assert bounded <= 10 + 50


def test_after_a_flood_the_next_burst_is_heard_at_once():
    """The budget grows while the air is quiet; a reserve of one is enough."""
    rng = np.random.default_rng(6)
    pdus, burst = a_burst(rng)
    expected = EXPECTED._replace(every=2000, misses=10)
    parts = a_flood(rng, RATE // 4), noise(rng, 10_000), burst + noise(rng, len(burst))
    assert heard(phy.Receiver(expected=expected), np.concatenate(parts)) == pdus


def test_bursts_that_are_heard_cost_no_budget():
    rng = np.random.default_rng(7)
    sent, parts = [], []
    for _ in range(40):
        pdus, burst = a_burst(rng)
        sent += pdus
        parts += [burst + noise(rng, len(burst)), noise(rng, 300)]
    receiver = phy.Receiver(expected=EXPECTED._replace(every=10**9, misses=5))
    assert heard(receiver, np.concatenate(parts)) == sent
    assert receiver.counters["peaks_skipped"] == 0


@law(20)
@given(st.lists(st.integers(1, 5000), max_size=60), st.integers(0, 2**32 - 1))
def test_what_is_refused_does_not_depend_on_the_chunks(sizes, seed):
    rng = np.random.default_rng(seed)
    _, burst = a_burst(rng)
    false, flood = a_header(rng), a_flood(rng, 12 * HEADER)
    x = np.concatenate((noise(rng, 700), false, burst, flood, noise(rng, 2500), burst))
    expected = EXPECTED._replace(every=900, misses=3)
    whole, pieces = (phy.Receiver(expected=expected) for _ in range(2))
    events = whole.push(x)
    at, parts = 0, []
    for size in sizes:
        parts += pieces.push(x[at : at + size])
        at += size
    parts += pieces.push(x[at:])
    assert parts == events
    assert (pieces.counters, pieces.claim) == (whole.counters, whole.claim)


@pytest.mark.slow
def test_the_reference_refuses_the_same():
    rng = np.random.default_rng(8)
    _, burst = a_burst(rng)
    foreign, false = a_header(rng, network=2), a_header(rng)
    silence = noise(rng, 2000)
    x = np.concatenate(
        (silence, false, burst, silence, foreign, silence, a_flood(rng, 12 * HEADER), burst)
    )
    expected = EXPECTED._replace(every=900, misses=3)
    ours, other = phy.Receiver(expected=expected), reference.Receiver(expected=expected)
    assert heard(ours, x) == heard(other, x)
    assert ours.counters == other.counters
    assert ours.claim[:2] == other.claim[:2]


@pytest.mark.parametrize(
    ("size", "network", "told"),
    [(SIZE, 3, [(3, SIZE)]), (SIZE + 32, 0, [(0, SIZE + 32)]), (SIZE, 0, [])],
)
def test_a_link_of_another_network_or_pdu_length_is_told_after_three_bursts(size, network, told):
    rng = np.random.default_rng(SEED)
    receiver = phy.Receiver(0, expected=EXPECTED)
    for n in range(1, 4):
        assert receiver.others(RATE) == []
        x = noise(rng, 6000)
        _, burst = a_burst(rng, size, 1, network=network)
        x[1000 : 1000 + len(burst)] += burst
        receiver.push(x)
        assert (receiver.counters["bursts"] == n) == (not told)
    assert receiver.others(RATE) == told
    # It is forgotten once it has not been heard for as long as is asked.
    receiver.push(noise(rng, 20_000))
    assert receiver.others(20_000) == []
    assert receiver.others(RATE) == told
