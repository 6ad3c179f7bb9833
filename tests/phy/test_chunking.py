"""The receiver's law: chunking of the stream makes no difference."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from phy import BurstOver, PduHeard, Receiver, Transmitter
from tests.laws import law
from tests.phy.chunks import chunk_sizes, make_stream, push_all
from tests.phy.signals import endings, heard, noise, payloads, silence


def receive(x, gap_at, gap, sizes, **settings):
    """(events, counters) of `x` in chunks; if given, `gap` samples are missing at `gap_at`."""
    receiver = Receiver(**settings)
    events = push_all(receiver, x[:gap_at], sizes)
    if gap_at is not None:
        events += receiver.gap(gap) + push_all(receiver, x[gap_at:], sizes)
    return events + receiver.flush(), receiver.counters


@law(150)
@given(st.integers(0, 2**32), chunk_sizes, st.booleans())
def test_any_chunking_yields_the_same_events_and_counts(seed, sizes, with_gap):
    x, gap_at, gap, _ = make_stream(seed)
    where = gap_at if with_gap else None
    whole, counted = receive(x, where, gap, [len(x)])
    events, counters = receive(x, where, gap, sizes)
    assert events == whole
    assert counters == counted


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("settings", [{}, {"network": None, "max_frequency": 0.1}])
def test_sample_by_sample_yields_the_same(seed, settings):
    x, gap_at, gap, _ = make_stream(seed)
    where = gap_at if seed % 2 else None
    whole, counted = receive(x, where, gap, [len(x)], **settings)
    events, counters = receive(x, where, gap, [1], **settings)
    assert events == whole
    assert counters == counted


@pytest.mark.slow
def test_one_cut_anywhere_yields_the_same():
    """Cuts around a burst's start, its header and its end, and the ends of its PDUs."""
    rng = np.random.default_rng(2)
    pdus = payloads(rng, 3, 30)
    burst = Transmitter().modulate(pdus, 3)
    x = np.concatenate((silence(530), burst, burst))
    x += noise(rng, len(x), 0.01)
    whole, counted = receive(x, None, 0, [len(x)])
    assert heard(whole) == pdus * 2
    for cut in range(1, len(x), 2):
        events, counters = receive(x, None, 0, [cut, len(x)])
        assert events == whole, cut
        assert counters == counted, cut


@pytest.mark.parametrize("size", [301, 100_000])
def test_a_stream_far_longer_than_what_is_kept(size):
    """The kept samples move to the buffer's start repeatedly, even in the middle of a burst."""
    rng = np.random.default_rng(3)
    pdus = payloads(rng, 2, 20)
    period = np.concatenate((Transmitter().modulate(pdus, 3), silence(int(rng.integers(150, 250)))))
    n = 1_200_000 // len(period)
    x = np.tile(period, n) + noise(rng, n * len(period), 0.01)
    events, counters = receive(x, None, 0, [size])
    assert heard(events) == pdus * n
    assert counters["samples"] == len(x)
    starts = [event.burst.start for event in events if isinstance(event, BurstOver)]
    assert np.abs(starts - len(period) * np.arange(n)).max() <= 2


@pytest.mark.slow
def test_the_streams_hold_what_they_are_meant_to():
    """The positive control: without gaps, every whole burst of ours is received, in order."""
    all_endings, n_sent, n_heard, n_odd = set(), 0, 0, 0
    for seed in range(60):
        x, gap_at, gap, sent = make_stream(seed)
        events, counters = receive(x, None, 0, [1000])
        got = heard(events)
        n_sent += len(sent)
        n_heard += len([pdu for pdu in sent if pdu in got])
        n_odd += counters["headers_bad"] + counters["samples_bad"]
        all_endings |= set(endings(events))
        cut_events, _ = receive(x, gap_at, gap, [1000])
        all_endings |= set(endings(cut_events))
        assert all(isinstance(event, (PduHeard, BurstOver)) for event in events)
    assert n_sent > 300
    assert n_heard > 0.98 * n_sent
    assert n_odd > 20
    assert all_endings == {"whole", "faded", "cut", "foreign"}


def test_a_pushed_array_is_left_alone_and_may_be_used_again():
    sent = b"that is mine"
    burst = Transmitter().modulate([sent], 0)
    mine = burst[:900].copy()
    mine[300] = np.nan
    before = mine.copy()
    receiver = Receiver()
    receiver.push(mine)
    assert np.array_equal(mine, before, equal_nan=True)
    mine[:] = 0
    assert heard(receiver.push(burst[900:])) == [sent]


def test_no_samples_are_no_event():
    receiver = Receiver()
    assert receiver.push(silence(0)) == []
    assert receiver.next_index == 0
