"""Each node's count of samples: when it is deaf, what is too late, who is present."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backends import GAP, RadioParams
from backends.testing import LEAD, MARGIN
from phy import PROFILES
from tests.backends.airs import (
    PLAIN,
    RATE,
    burst,
    deafness,
    half_duplex,
    heard,
    line,
    loud,
    medium,
)
from tests.laws import law

END_S = 0.008
END = round(END_S * RATE)

some_bursts = st.lists(
    st.tuples(st.integers(0, 2), st.integers(0, 5000), st.integers(1, 900)), max_size=6
)
some_times = st.lists(st.floats(0, END_S), max_size=8).map(sorted)


def taken(made, node, times):
    """All pieces of a node up to each of the times in turn, and to the end."""
    return [piece for t in [*times, END_S] for piece in made.take(node, t)]


def indices(begin, end):
    return list(range(begin, end))


@pytest.mark.parametrize("turnaround_s", [0.0, 0.0001, 0.0001234])
@pytest.mark.parametrize("clock_ppm", [0.0, 200.0])
def test_a_half_duplex_node_is_deaf_from_turnaround_before_to_turnaround_after(
    turnaround_s, clock_ppm
):
    """In the node's own count; no sample more or less."""
    made = medium({0: half_duplex(turnaround_s, clock_ppm=clock_ppm), 1: PLAIN})
    turnaround = math.ceil(turnaround_s * RATE * (1 + 1e-6 * clock_ppm))
    spans = [(1000, 1500), (3000, 3001), (4000, 4900)]
    for begin, end in spans:
        assert made.send(0, burst(begin, end - begin)) == begin
    pieces = made.take(0, END_S)
    wanted = [i for begin, end in spans for i in indices(begin - turnaround, end + turnaround)]
    assert np.flatnonzero(deafness(pieces)).tolist() == wanted
    assert [piece.is_deaf for piece in pieces] == [False, True] * 3 + [False]
    assert not deafness(made.take(1, END_S)).any(), "others hear on"


def test_deafness_of_bursts_close_together_is_one():
    made = medium({0: half_duplex(0.0002)})
    for begin in (1000, 1000 + 300 + GAP):
        assert made.send(0, burst(begin, 300)) == begin
    deaf = deafness(made.take(0, END_S))
    assert np.flatnonzero(deaf).tolist() == indices(800, 1600 + GAP + 200)


@law(60)
@given(some_bursts, some_times, st.sampled_from([0, 80]))
def test_who_is_deaf_misses_what_arrives_meanwhile_and_nothing_else(bursts, times, turnaround):
    lines = []
    for radio in (half_duplex(turnaround / RATE), PLAIN):
        made = medium({0: radio, 1: PLAIN, 2: PLAIN})
        for i, (sender, start, n) in enumerate(bursts):
            made.send(sender, burst(200 + start, n, seed=i))
        pieces = taken(made, 0, times)
        lines.append((line(pieces), deafness(pieces)))
    (half, deaf), (full, never_deaf) = lines
    assert not never_deaf.any()
    assert not half[deaf].any()
    assert np.array_equal(half[~deaf], full[~deaf])


@pytest.mark.slow
@law(80)
@given(some_bursts, some_bursts, some_times, some_times, st.sampled_from(list(PROFILES)))
def test_whenever_samples_are_taken_they_are_the_same(early, late, times, others, profile):
    """Each sample once and in order, for three nodes with their own clocks and radios."""
    radios = {
        0: RadioParams(clock_ppm=150),
        1: half_duplex(0.0001, clock_ppm=-60),
        2: RadioParams(),
    }
    results = []
    for grid in ((), times, others):
        made = medium(radios, profile=profile, delay_spread_s=1e-6)
        pieces = {node: [] for node in radios}
        for begin_s, until_s, bursts in ((0, END_S / 4, early), (END_S / 4, END_S, late)):
            for i, (sender, start, n) in enumerate(bursts):
                made.send(sender, burst(made.next_index(sender) + start, n, seed=i))
            for t in [*(each for each in grid if begin_s < each < until_s), until_s]:
                for node in radios:
                    pieces[node] += made.take(node, t)
        results.append(pieces)
    for node in radios:
        whole, *chunked = (result[node] for result in results)
        for each in chunked:
            assert np.array_equal(line(each), line(whole))
            assert np.array_equal(deafness(each), deafness(whole))


@law()
@given(some_bursts, some_times, st.booleans())
def test_pieces_are_as_long_as_they_say_and_never_empty(bursts, times, is_half):
    made = medium({0: half_duplex(0.0001) if is_half else PLAIN, 1: PLAIN, 2: PLAIN})
    for sender, start, n in bursts:
        made.send(sender, burst(start, n))
    for t in [*times, END_S]:
        before = made.next_index(0)
        pieces = made.take(0, t)
        assert made.next_index(0) == math.floor(t * RATE)
        assert made.next_index(0) - before == sum(piece.n for piece in pieces)
        for piece in pieces:
            assert piece.n > 0
            assert piece.samples is None or (not piece.is_deaf and len(piece.samples) == piece.n)


@pytest.mark.parametrize("radio", [PLAIN, half_duplex(0.0005)])
@pytest.mark.parametrize("profile", ["awgn", "tdl-a"])
def test_an_exact_burst_that_is_late_does_not_leave_at_all(radio, profile):
    made = medium({0: radio, 1: PLAIN}, profile=profile)
    for node in (0, 1):
        made.take(node, 0.001)
    earliest = 1000 + round(radio.turnaround_s * RATE) + MARGIN
    assert made.send(0, burst(earliest - 1, 400, exact=True)) is None
    assert (made.bursts, made.bursts_late) == (0, 1)
    assert not deafness(made.take(0, 0.0013)).any()
    assert not heard(made, 1, END_S).any()
    # A late burst does not block the next one.
    assert made.send(0, burst(1300 + earliest - 1000, 9, exact=True)) == 300 + earliest
    assert (made.bursts, made.bursts_late) == (1, 1)


@pytest.mark.parametrize("radio", [PLAIN, half_duplex(0.0005)])
def test_a_burst_that_is_late_leaves_as_soon_as_it_can(radio):
    made = medium({0: radio, 1: PLAIN})
    made.take(0, 0.001)
    earliest = 1000 + round(radio.turnaround_s * RATE) + MARGIN
    assert made.send(0, burst(0, 400)) == earliest
    assert made.send(0, burst(0, 100)) == earliest + 400 + GAP
    assert made.send(0, burst(earliest + 500 + 2 * GAP, 9)) == earliest + 500 + 2 * GAP
    assert loud(heard(made, 1, END_S)) == [
        *indices(earliest, earliest + 400),
        *indices(earliest + 400 + GAP, earliest + 500 + GAP),
        *indices(earliest + 500 + 2 * GAP, earliest + 509 + 2 * GAP),
    ]


@pytest.mark.parametrize("radio", [PLAIN, half_duplex(0.0005)])
def test_a_burst_handed_over_by_the_lead_is_in_time(radio):
    made = medium({0: radio})
    made.take(0, 0.001)
    start = 1000 + round(radio.turnaround_s * RATE) + LEAD
    assert made.send(0, burst(start, 40, exact=True)) == start


@law(60)
@given(
    st.floats(0, 0.004),
    st.floats(-200, 200),
    st.floats(-200, 200),
    st.sampled_from(list(PROFILES)),
)
def test_as_soon_as_it_can_is_soon_enough_to_arrive_whole(now_s, sends_ppm, hears_ppm, profile):
    """Whatever the clocks, and with echoes that arrive before the burst's own first sample."""
    radios = {0: RadioParams(clock_ppm=sends_ppm), 1: RadioParams(clock_ppm=hears_ppm)}
    late, planned = (medium(radios, profile=profile) for _ in range(2))
    before = [piece for node in (1, 0) for piece in late.take(node, now_s) if node == 1]
    start = late.send(0, burst(0, 300))
    assert planned.send(0, burst(start, 300, exact=True)) == start
    assert np.array_equal(line([*before, *late.take(1, END_S)]), heard(planned, 1, END_S))


@pytest.mark.parametrize("clock_ppm", [-20.0, 0.0, 20.0])
def test_a_crystal_makes_so_many_samples_in_so_many_seconds(clock_ppm):
    made = medium({0: RadioParams(clock_ppm=clock_ppm)})
    n = sum(piece.n for step in range(1, 1001) for piece in made.take(0, step * 0.1))
    assert n == pytest.approx(100 * RATE * (1 + 1e-6 * clock_ppm), abs=1)
    assert made.time(0, n) == pytest.approx(100, abs=2 / RATE)


def test_who_joins_late_begins_at_0_and_hears_what_is_sent_from_then_on():
    made = medium(2)
    made.send(0, burst(1000, 100))
    for node in (0, 1):
        made.take(node, 0.002)
    made.join(2, PLAIN, 0.002)
    assert made.next_index(2) == 0
    assert made.time(2, 0) == 0.002
    made.send(0, burst(3000, 100))
    assert loud(heard(made, 2, 0.004)) == indices(1000, 1100)
    assert loud(heard(made, 1, 0.004)) == indices(1000, 1100)
    # Its own bursts are in its own count.
    assert made.send(2, burst(2500, 50)) == 2500
    assert loud(heard(made, 1, 0.006)) == indices(500, 550)


def test_what_was_sent_arrives_also_when_its_sender_has_left():
    made = medium(3)
    made.send(0, burst(1000, 100))
    heard(made, 1, 0.00105)
    made.leave(0)
    made.leave(0)
    with pytest.raises(KeyError):
        made.next_index(0)
    assert np.count_nonzero(heard(made, 1, 0.002)) == 50
    assert np.count_nonzero(heard(made, 2, 0.002)) == 100
    # A node that has left gets nothing, and one that returns starts over.
    made.send(1, burst(3000, 100))
    made.join(0, PLAIN, 0.002)
    assert not heard(made, 0, 0.01).any()
    assert made.send(0, burst(9000, 10)) == 9000


def test_a_node_that_left_does_not_change_what_others_hear():
    lines = []
    for leaves in (False, True):
        made = medium(3, profile="rayleigh")
        made.send(0, burst(1000, 100))
        if leaves:
            made.leave(2)
        made.send(0, burst(3000, 100))
        lines.append(heard(made, 1, END_S))
    assert np.array_equal(*lines)
