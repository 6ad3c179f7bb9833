"""What is known of a source: its numbers, its least lead, and how long its word counts."""

from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.sealing.testing import Least, Peer, Peers, Proof, Window
from tests.laws import law

LIMIT_S = 0.13
LATE_TICKS = 64
"""How far behind the newest T a PDU may be."""


@law(60)
@given(
    st.integers(0, 100),
    st.lists(st.tuples(st.integers(0, 260), st.sampled_from([0, 1, 255])), max_size=60),
)
def test_each_number_is_taken_once_unless_it_is_too_old(oldest, numbers):
    window, seen, newest = Window(oldest), set(), -1
    for number in numbers:
        ticks, _ = number
        least = max(oldest, newest - LATE_TICKS)
        reason = "sec_replay" if ticks < least else "rx_dup" if number in seen else ""
        assert window.judge(*number) == reason
        if not reason:
            window.take(*number)
            seen.add(number)
            newest = max(newest, ticks)
        assert window.newest == newest


def test_what_is_as_late_as_it_may_be_is_taken_once():
    window = Window()
    for ticks in (100, 100 + LATE_TICKS):
        window.take(ticks, 1)
    told = [window.judge(*number) for number in ((99, 2), (100, 1), (100, 2))]
    assert told == ["sec_replay", "rx_dup", ""]


@law(60)
@given(st.lists(st.tuples(st.integers(0, 50), st.floats(-5, 5)), min_size=1, max_size=30))
def test_the_least_value_is_that_of_the_last_half_minute_and_a_little_more(steps):
    least, at, noted = Least(), 100, []
    for step, value in steps:
        at += step
        least.add(value, at)
        noted.append((at, value))
        assert least.added_at == at
        assert min(v for t, v in noted if t > at - 90) <= least.value
        assert least.value <= min(v for t, v in noted if t >= least.until - 30)
        assert 0 < least.until - at <= 30
        assert least.lately == min(v for t, v in noted if t >= least.until - 30)


def test_what_counts_moves_on_every_30_s():
    least = Least()
    assert (least.value, least.lately) == (inf, inf)
    told = []
    for at, value in ((0, 1.0), (29, 2.0), (30, 3.0), (59, 2.5), (60, 4.0), (119, 9.0), (180, 7.0)):
        least.add(value, at)
        told.append(least.value)
    assert told == [1.0, 1.0, 1.0, 1.0, 2.5, 4.0, 7.0]


def proven(ahead_s=5.0, at=10.0, lead_s=-4.99):
    """A peer that is proven, whose PDUs take 10 ms."""
    peer = Peer(lambda kid: 7 * kid)
    assert not peer.note(lead_s, at, 0, LIMIT_S)
    peer.heard_at = at
    peer.prove(Proof(ahead_s, at))
    return peer


def test_a_proof_lasts_a_minute_if_the_source_is_heard():
    peer = proven()
    assert peer.is_proven(29.99)
    assert not peer.is_proven(30.0), "silent for 20 s"
    for at in range(11, 70):
        assert not peer.note(-4.99, at, 0, LIMIT_S)
        peer.heard_at = at
        assert peer.is_proven(at)
    assert not peer.is_proven(70.0)
    assert peer.note(-4.99, 70.0, 0, LIMIT_S), "it has ended"
    assert (peer.proof, peer.first_at) == (None, 70.0)
    assert not peer.note(-4.99, 71.0, 0, LIMIT_S), "once"
    assert peer.first_at == 70.0


def test_a_source_that_was_silent_must_prove_anew():
    for at, ends in ((29.9, False), (30.0, True)):
        peer = proven()
        assert peer.note(-4.99, at, 0, LIMIT_S) == ends
        assert (peer.proof is None) == ends
        assert peer.least.value == -4.99, "its clock goes on"


def test_a_pdu_that_comes_before_it_was_sent_shows_another_clock():
    for lead_s, ends in ((-5.12, False), (-5.14, True)):
        peer = proven()
        assert peer.note(lead_s, 11.0, 0, LIMIT_S) == ends
        assert (peer.proof is None) == ends
        assert peer.least.value == lead_s
        assert peer.first_at == (11.0 if ends else 10.0)


def test_with_another_key_the_clock_of_a_source_may_begin_anew():
    for lead_s, ends in ((-4.0, False), (-5.9, False), (-3.9, True), (-6.1, True)):
        peer = proven()
        peer.least.add(-5.0, 10.0)
        assert peer.note(lead_s, 11.0, 1, 5.0) == ends, lead_s
        assert (peer.proof is None) == ends
        assert peer.least.value == (lead_s if ends else min(lead_s, -5.0))
    unproven = Peer(lambda _: 0)
    unproven.note(0.0, 1.0, 0, LIMIT_S)
    assert not unproven.note(9.0, 2.0, 1, LIMIT_S), "no proof has ended"
    assert unproven.least.value == 9.0


def test_the_least_lead_is_kept_in_the_usual_case_too():
    peer = Peer(lambda _: 0)
    for at, lead_s, value in ((1.0, 0.5, 0.5), (2.0, 0.7, 0.5), (3.0, 0.4, 0.4), (31.0, 0.9, 0.4)):
        peer.note(lead_s, at, 0, LIMIT_S)
        assert (peer.least.value, peer.least.added_at) == (value, at)
    assert peer.first_at == 1.0
    peer.restart()
    assert (peer.least.value, peer.proof) == (inf, None)


@pytest.mark.parametrize(
    ("lead_s", "held_s", "own_age_s", "is_late"),
    [
        (-4.99, 0.0, 100.0, False),
        (-4.88, 0.0, 100.0, False),
        (-4.86, 0.0, 100.0, True),
        (-4.50, 0.49, 100.0, False),
        (-4.50, 0.36, 100.0, True),
        (-4.99, 0.2, 100.0, True),  # It says more than is true.
        (-4.50, 0.49, 0.4, True),  # It was sent before this life of ours began.
        (-4.50, 0.49, 0.51, False),
    ],
)
def test_the_delay_of_a_proven_source_is_known(lead_s, held_s, own_age_s, is_late):
    assert proven().is_late(lead_s, held_s, LIMIT_S, own_age_s, True) == is_late
    if is_late and held_s != 0.2:
        assert not proven().is_late(lead_s, held_s, LIMIT_S, own_age_s, False)


@pytest.mark.parametrize("is_judged", [True, False])
def test_of_others_the_least_delay_is_the_measure(is_judged):
    peer = Peer(lambda _: 0)
    peer.note(0.5, 1.0, 0, LIMIT_S)
    for lead_s, held_s, is_late in (
        (0.5, 0.0, False), (0.62, 0.0, False), (0.64, 0.0, is_judged), (0.5, 0.12, False),
        (0.5, 0.14, True), (0.9, 0.4, False), (0.9, 0.26, is_judged),
    ):  # fmt: skip
        assert peer.is_late(lead_s, held_s, LIMIT_S, 0.01, is_judged) == is_late, (lead_s, held_s)


def test_peers_keep_the_numbers_of_each_key_apart():
    peers = Peers(lambda src, kid: 100 * src + kid)
    one = peers.of(1)
    assert peers.of(1) is one
    assert not peers.was_opened(1)
    assert not peers.was_opened(2)
    window = one.window(3)
    assert one.window(3) is window
    assert (window.judge(102, 0), window.judge(103, 0)) == ("sec_replay", "")
    assert peers.newest(3) == {}
    window.take(103, 0)
    one.window(0).take(100, 0)
    peers.of(2).window(3).take(500, 1)
    peers.of(4).window(3)
    peers.of(5).window(3).take(0, 0)
    assert peers.newest(3) == {1: 103, 2: 500, 5: 0}
    assert peers.newest(0) == {1: 100}
    assert peers.newest(1) == {}
    assert [src for src in range(1, 6) if peers.was_opened(src)] == [1, 2, 5]
    peers.change_key(3)
    assert (peers.newest(3), peers.newest(0)) == ({}, {1: 100})
    assert dict(peers) == {1: one, **{src: peers.of(src) for src in (2, 4, 5)}}


def test_a_life_begins_once_until_the_clock_begins_anew():
    peers = Peers(lambda _src, _kid: 0)
    peers.of(1).note(0.5, 1.0, 0, LIMIT_S)
    peers.of(1).prove(Proof(0.0, 1.0))
    assert peers.of(1).heard_at == 1.0
    for now in (3.0, 4.0):
        peers.begin(now)
        assert peers.began == 3.0
    peers.restart()
    assert (peers.began, peers.of(1).proof, peers.of(1).least.value) == (-inf, None, inf)
    peers.begin(9.0)
    assert peers.began == 9.0
