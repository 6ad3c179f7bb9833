"""Sequence numbers: duplicates refused, losses counted."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import Qos
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


@pytest.mark.parametrize("behind", [100, 150, 200])
def test_what_a_relay_sends_may_be_far_behind(behind):
    """Every third PDU is urgent, and overtakes those that wait at the relay."""
    order = sorted(range(900), key=lambda number: number + behind * (number % 3 > 0))
    track = SequenceTrack()
    for at, number in enumerate(order):
        qos = Qos.BULK if number % 3 else Qos.LATENCY
        assert track.heard(number & 0xFF, number, 1e-3 * at, forwarded=qos)
        assert track.number == number
        # A robot further on forwards what we have sent it.
        echo = order[max(0, at - 400)]
        assert not track.heard(echo & 0xFF, echo, 1e-3 * at, forwarded=qos)
    assert (track.lost, track.restarts) == (0, 0)


def test_the_first_pdu_that_a_relay_sends_may_be_far_ahead():
    track = SequenceTrack()
    assert track.heard(10, 1)
    assert track.heard(10 + 60, 2, 0.1, forwarded=Qos.LATENCY)


def test_what_overtakes_at_a_relay_shows_what_waits_there():
    track = SequenceTrack()
    for number in range(300):
        track.heard(number & 0xFF, number, 1e-3 * number, forwarded=Qos.LATENCY)
    assert track.heard(400 & 0xFF, 400, 0.3, forwarded=Qos.LATENCY)
    assert (track.newest, list(track.skipped)) == (400, list(range(300, 400)))


def test_what_a_relay_sends_after_a_pause_may_be_far_ahead():
    track = SequenceTrack()
    for number in range(50):
        track.heard(number, number, 1e-3 * number, forwarded=Qos.LATENCY)
    assert track.heard(120, 120, 2.0, forwarded=Qos.LATENCY)
    assert (track.newest, track.lost) == (120, 70)


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


def numbered(track, first, n, *, at, every_s, told=()):
    """Hear `n` PDUs from number `first` on, of which those in `told` tell their number."""
    for i in range(first, first + n):
        assert track.heard(
            i & 0xFF, i & 0xFFFF, at + (i - first) * every_s, i if i in told else None
        )


@pytest.mark.parametrize("outage", [1, 44, 127, 128, 150, 254, 255, 256, 300, 511, 512, 5000])
@pytest.mark.parametrize("before", [10, 300, 1000])
def test_an_outage_of_any_length_is_counted_when_a_number_is_told(outage, before):
    track = SequenceTrack()
    numbered(track, 70, before, at=0.0, every_s=0.01, told=(75,))
    after = 70 + before + outage
    numbered(track, after, 30, at=20.0 + 0.01 * before, every_s=0.01, told=(after + 20,))
    assert (track.lost, track.restarts) == (outage, 0)
    assert track.newest == after + 29


def test_a_number_that_no_source_could_have_reached_is_not_believed():
    track = SequenceTrack()
    numbered(track, 0, 100, at=0.0, every_s=0.01, told=(0,))
    assert track.heard(100, 1, 1.0, 100 + (1 << 31))
    assert track.heard(101, 2, 1.01, 101)
    assert (track.lost, track.newest) == (0, 101)


@pytest.mark.parametrize("ahead", [20_300, 25_000, 99_000, -25_000])
def test_after_a_false_number_the_second_true_one_is_believed(ahead):
    track = SequenceTrack()
    numbered(track, 0, 100, at=0.0, every_s=0.01, told=(0,))
    track.heard(200, 1, 5.0, told=100 + ahead & ~0xFF | 200)
    numbered(track, 201, 20, at=5.1, every_s=0.01, told=(210, 220))
    assert track.newest == 220
    numbered(track, 221, 20, at=5.4, every_s=0.01, told=range(221, 240))
    assert (track.newest, track.number, track.is_numbered) == (240, 240, True)


def test_numbers_wrap_around():
    track = SequenceTrack()
    for i in range(200):
        number = (1 << 32) - 100 + i
        assert track.heard(number & 0xFF, i, 0.01 * i, number % (1 << 32))
    assert track.lost == 0
    assert track.newest == (1 << 32) + 99


def test_a_repeated_pdu_is_known_by_its_number_for_a_second():
    track = SequenceTrack()
    numbered(track, 0, 1000, at=0.0, every_s=0.001, told=range(0, 1000, 10))
    assert not track.heard(300 & 0xFF, 300, 1.0, 300)
    # Another PDU of the same sequence number and content is not a copy.
    assert track.heard(1000 & 0xFF, 1000 - 256, 1.0)


@law(60)
@given(st.integers(0, 2**32), st.floats(0, 0.5), st.integers(0, (1 << 32) - 1))
def test_what_is_repeated_fills_the_gap_once(seed, loss, first):
    rng = Random(seed)
    track, missing, heard = SequenceTrack(), [], []
    for i in range(600):
        number, at = (first + i) % (1 << 32), 0.002 * i
        if i and rng.random() < loss:
            missing.append((i, number))
            continue
        told = number if i == 0 or rng.random() < 0.1 else None
        assert track.heard(number & 0xFF, i, at, told)
        heard.append((i, number))
        if missing and rng.random() < 0.3:
            again = missing.pop(rng.randrange(len(missing)))
            assert track.heard(again[1] & 0xFF, again[0], at, again[1])
            assert track.fills
            heard.append(again)
        again = rng.choice([each for each in heard if each[0] > i - 400])
        assert not track.heard(again[1] & 0xFF, again[0], at, again[1])
    assert track.restarts == 0
    assert track.lost == max(i for i, _ in heard) + 1 - len(heard)
