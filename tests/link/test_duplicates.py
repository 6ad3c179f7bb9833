"""Sequence numbers: duplicates refused, losses counted."""

from random import Random

from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link.receive import SequenceTrack
from tests.laws import law


def test_a_copy_is_a_duplicate_also_when_late():
    track = SequenceTrack()
    assert [track.heard(seq, 7) for seq in (0, 1, 1, 2, 0)] == [True, True, False, True, False]


def test_same_number_with_other_content_is_another_pdu():
    track = SequenceTrack()
    track.heard(5, 1)
    assert track.heard(5, 2)


def test_a_number_returns_after_256():
    track = SequenceTrack()
    assert all(track.heard(i & 0xFF, 7) for i in range(1000))
    assert track.lost == 0


def test_late_arrivals_take_the_count_back():
    track = SequenceTrack()
    for seq in (10, 13):
        track.heard(seq, 0)
    assert track.lost == 2
    assert track.heard(11, 0)
    assert track.lost == 1


@law(60)
@given(st.integers(0, 2**32), st.floats(0, 0.6), st.integers(0, 255))
def test_losses_are_exact_while_gaps_stay_below_128(seed, loss, first):
    rng = Random(seed)
    track, lost, gap = SequenceTrack(), 0, 0
    track.heard(first, 0)
    for i in range(1, 2000):
        if rng.random() < loss and gap < 126:
            gap += 1
            continue
        lost += gap
        gap = 0
        seq = (first + i) & 0xFF
        assert track.heard(seq, i & 0xFFFF)
        assert not track.heard(seq, i & 0xFFFF)
    assert track.lost == lost
    assert track.restarts == 0


@law(60)
@given(st.integers(0, 2**32))
def test_any_order_within_the_window_delivers_each_once(seed):
    rng = Random(seed)
    order = sorted(range(600), key=lambda i: i + rng.uniform(0, 60))
    order += order[-50:]
    track = SequenceTrack()
    fresh = [i for i in order if track.heard(i & 0xFF, i & 0xFFFF)]
    assert sorted(fresh) == list(range(600))


def test_a_restarted_sender_is_heard_at_once():
    track = SequenceTrack()
    for seq in range(200):
        track.heard(seq, 1)
    assert track.heard(190, 2)
    assert track.restarts == 1
    assert track.heard(191, 3)


@law(40)
@given(st.integers(0, 255), st.integers(0, 255), st.integers(0, 5))
def test_a_restart_that_looks_like_a_step_ahead_adds_no_losses(first, second, before_beacon):
    track = SequenceTrack()
    for i in range(10):
        track.heard((first + i) & 0xFF, i)
    track.heard((first + 12) & 0xFF, 12)
    track.goes_on()
    # The new life begins anywhere; its beacon, with a new boot id, comes some PDUs later.
    for i in range(before_beacon + 1):
        track.heard((second + i) & 0xFF, 1000 + i)
    track.restart((second + before_beacon) & 0xFF, 1000 + before_beacon)
    # A step back into a gap counts as a late arrival, so up to two losses may be taken back.
    assert 0 <= track.lost <= 2
    if 13 <= (second - first) & 0xFF < 128:
        assert track.lost == 2
