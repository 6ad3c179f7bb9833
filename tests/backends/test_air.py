"""Simulated air: bursts on one line, random numbers, and the time of arrival."""

import threading
import time
import weakref
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backends import BackendError, Channel
from backends.testing import Pace, Timeline
from phy import PROFILES, FrontEndParams, PathParams
from tests.backends.radios import AIR, RATE, noise
from tests.laws import law

END = 2500
TIMEOUT_S = 20


def air(seed=1, noise_dbfs=-np.inf, **path):
    """A channel of that seed; keywords are the path's parameters."""
    return Channel(PathParams(rate_hz=1e6, **path), FrontEndParams(noise_dbfs=noise_dbfs), seed)


def taken(timeline, index, n):
    """A piece of the line; zeros for silence."""
    samples = timeline.take(index, n)
    return np.zeros(n, np.complex64) if samples is None else samples


def line(channel, bursts, sizes):
    """What arrives of bursts, each (start, length), read in pieces of these sizes."""
    timeline, path = Timeline(), channel.make_path()
    for start, n in bursts:
        timeline.add(start, noise(n, seed=start), path)
    pieces, index = [], 0
    for n in sizes:
        pieces.append(taken(timeline, index, n))
        index += n
    pieces.append(taken(timeline, index, END - index))
    return np.concatenate(pieces)


def carried(channel, bursts):
    """What arrives of bursts if each is carried by itself and added up."""
    path, wanted = channel.make_path(), np.zeros(2 * END, np.complex64)
    for start, n in bursts:
        offset, samples = path.carry(noise(n, seed=start))
        wanted[start + offset : start + offset + len(samples)] += samples
    return wanted[:END]


some_bursts = st.lists(st.tuples(st.integers(20, 2000), st.integers(0, 600)), max_size=6).map(
    sorted
)
some_sizes = st.lists(st.integers(0, 400), max_size=6)


@law(100)
@given(some_bursts, some_sizes, st.sampled_from([0, 7, 130]))
def test_any_pieces_are_the_line_of_all_bursts_added_up(bursts, sizes, delay):
    channel = air(delay_s=delay / 1e6, loss_db=3)
    whole = line(channel, bursts, [])
    assert np.array_equal(line(channel, bursts, sizes), whole)
    assert np.abs(whole - carried(channel, bursts)).max() < 1e-6


@pytest.mark.parametrize("profile", PROFILES)
def test_echoes_arrive_on_the_line_as_the_path_carries_them(profile):
    channel = air(profile=profile, delay_spread_s=2e-6, delay_s=3.3e-6, clock_ppm=10)
    bursts = [(100, 300), (350, 100), (900, 10)]
    wanted = carried(channel, bursts)
    assert np.abs(line(channel, bursts, []) - wanted).max() < 1e-6
    # Pieces that do not end shortly before a burst.
    assert np.abs(line(channel, bursts, [80, 240, 400]) - wanted).max() < 1e-6


@pytest.mark.parametrize("profile", ["tdl-a", "tdl-c"])
def test_pieces_may_end_right_before_a_burst_with_echoes(profile):
    channel = air(profile=profile, delay_spread_s=2e-6)
    bursts = [(100, 300)]
    assert np.array_equal(line(channel, bursts, [100]), line(channel, bursts, []))


def test_bursts_may_be_added_in_any_order():
    bursts = [(800, 100), (100, 100)]
    assert np.array_equal(line(air(), bursts, [500]), line(air(), bursts, []))


def test_each_burst_goes_through_its_own_path():
    """One path has echoes, which arrive before their burst, and the other has none."""
    one, other = air(loss_db=6), air(seed=2, profile="tdl-a", delay_s=5e-6)
    first, second = [(100, 300)], [(250, 300)]
    both, paths = Timeline(), (one.make_path(), other.make_path())
    for (start, n), path in zip(first + second, paths, strict=True):
        both.add(start, noise(n, seed=start), path)
    wanted = line(one, first, []) + line(other, second, [])
    assert np.count_nonzero(wanted[250:400]) == 150, "they overlap"
    assert np.abs(taken(both, 0, END) - wanted).max() < 1e-6


class Copies:
    """A path that keeps nothing alive, and tells what of it is still in memory."""

    early = 0

    def __init__(self):
        self._seen = []

    def carry(self, samples):
        """The same samples in an array of their own."""
        arriving = samples.copy()
        self._seen += [weakref.ref(samples), weakref.ref(arriving)]
        return 0, arriving

    def alive(self):
        """Number of arrays that somebody keeps, of those sent and those that arrive."""
        return sum(each() is not None for each in self._seen)


def test_what_has_been_read_is_forgotten():
    timeline, path = Timeline(), Copies()
    timeline.add(10, noise(20), path)
    timeline.add(50, noise(100), path)
    timeline.take(0, 100)
    assert path.alive() == 1, "half of the second arrives later"
    timeline.take(100, 100)
    assert path.alive() == 0


def test_a_burst_whose_time_has_passed_is_not_heard():
    timeline, path = Timeline(), AIR.make_path()
    timeline.take(0, 500)
    timeline.add(100, noise(200), path)
    assert not taken(timeline, 500, 500).any()
    timeline.add(900, noise(200), path)
    assert np.count_nonzero(timeline.take(1000, 500)) == 100


@pytest.mark.parametrize("profile", PROFILES)
def test_the_same_seed_is_the_same_air(profile):
    bursts = [(100, 300), (600, 100)]
    one, same, other = (line(air(seed, profile=profile), bursts, []) for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.allclose(one, other)


@pytest.mark.slow
def test_the_same_seed_is_the_same_noise():
    silence = np.zeros(1000, np.complex64)
    one, same, other = (
        air(seed, noise_dbfs=-20).make_front_end().receive(silence) for seed in (1, 1, 2)
    )
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


def test_noise_and_path_have_chance_of_their_own():
    """Drawing more noise does not change the fading."""
    channel = air(noise_dbfs=-20, profile="rayleigh")
    front_end, path, same = channel.make_front_end(), channel.make_path(), channel.make_path()
    front_end.receive(np.zeros(777, np.complex64))
    assert np.array_equal(path.carry(noise(9))[1], same.carry(noise(9))[1])


def test_an_unknown_profile_is_named_with_those_that_exist():
    with pytest.raises(BackendError, match='"fog"; allowed: one of awgn, rayleigh, tdl-a, tdl-c'):
        air(profile="fog").make_path()


@pytest.fixture
def clock(monkeypatch):
    """Pace's clock, which stands still until it is set."""
    clock = SimpleNamespace(ns=10**12)
    monkeypatch.setattr(time, "monotonic_ns", lambda: clock.ns)
    return clock


@law()
@given(st.lists(st.integers(0, 10**13), min_size=2), st.floats(1e3, 1e8))
def test_paced_time_grows_with_the_index(indices, rate_hz):
    pace = Pace(rate_hz, paced=True)
    indices.sort()
    times = [pace.host_ns(index) for index in indices]
    assert times == sorted(times)
    wanted = (indices[-1] - indices[0]) / rate_hz * 1e9
    assert times[-1] - times[0] == pytest.approx(wanted, rel=1e-12, abs=2)


def test_index_0_is_at_the_start(clock):
    pace = Pace(RATE, paced=True)
    assert pace.host_ns(0) == clock.ns
    clock.ns += 5 * 10**9
    pace.restart()
    assert pace.host_ns(0) == clock.ns
    assert pace.host_ns(300) == clock.ns + 3_000_000


def test_who_is_late_is_told_by_how_many_samples(clock):
    pace = Pace(RATE, paced=True)
    clock.ns += 10**9
    assert pace.wait_for(int(RATE)) == 0
    assert pace.wait_for(int(RATE) - 250) == 250


def test_who_is_early_waits():
    pace = Pace(RATE, paced=True)
    assert pace.wait_for(2000) == 0
    assert time.monotonic_ns() >= pace.host_ns(2000) - 1_000_000


def test_who_waits_is_woken_at_the_end():
    pace = Pace(RATE, paced=True)
    waiter = threading.Thread(target=pace.wait_for, args=(10**12,), daemon=True)
    waiter.start()
    pace.end()
    waiter.join(TIMEOUT_S)
    assert not waiter.is_alive()
    pace.end()
    assert pace.wait_for(10**12) == 0


def test_unpaced_time_is_now_and_nobody_waits():
    pace = Pace(RATE, paced=False)
    before = time.monotonic_ns()
    assert pace.wait_for(10**15) == 0
    times = [before, pace.host_ns(10**15), pace.host_ns(0), time.monotonic_ns()]
    assert times == sorted(times)
