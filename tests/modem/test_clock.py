"""The received stream as the clock."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.modem.testing import BlockTimes, StreamClock


class Clock:
    """A stream's clock, and the times of its blocks."""

    def __init__(self, rate_hz, *more, **named):
        self._clock, self._blocks = StreamClock(rate_hz, *more, **named), BlockTimes(rate_hz)
        self.observe = self._blocks.observe

    def now(self, host_s):
        return self._clock.now(self._blocks.seen, host_s)

    def is_gone(self, host_s):
        return self._clock.is_gone(self._blocks.seen, host_s)


def test_time_is_the_index_over_the_rate():
    clock = Clock(1e6, paced=True)
    clock.observe(2_000_000, 103.0)
    assert clock.now(103.0) == 2.0


def test_a_paced_stream_goes_on_between_blocks_and_when_they_stop():
    clock = Clock(1e6, paced=True)
    clock.observe(1000, 100.001)
    assert clock.now(100.0015) == pytest.approx(0.0015)
    assert clock.now(105.0) == pytest.approx(5.0)


def test_an_unpaced_stream_stands_still_between_blocks_and_goes_on_when_they_stop():
    clock = Clock(1e6, paced=False)
    clock.observe(1000, 100.0)
    assert clock.now(100.05) == 0.001
    assert clock.now(100.0 + StreamClock.QUIET_S + 2) == pytest.approx(2.001)


def test_in_lock_step_time_is_the_blocks_and_nobody_elses():
    clock = Clock(1e6, paced=False, lockstep=True)
    assert clock.now(100.0) == 0
    clock.observe(1000, 100.0)
    assert clock.now(100.0) == clock.now(160.0) == 0.001
    clock.observe(3000, 50.0)
    assert clock.now(1e6) == 0.003


def test_a_paced_stream_is_gone_when_no_block_comes_for_a_quarter_of_a_second():
    clock = Clock(1e6, paced=True)
    assert not clock.is_gone(1e6), "it has not begun"
    clock.observe(1000, 100.0)
    assert not clock.is_gone(100.0 + StreamClock.GONE_S - 0.01)
    assert clock.is_gone(100.0 + StreamClock.GONE_S + 0.01)
    clock.observe(2000, 101.0)
    assert not clock.is_gone(101.1)


@pytest.mark.parametrize("lockstep", [True, False])
def test_a_stream_at_no_pace_is_never_gone(lockstep):
    clock = Clock(1e6, paced=False, lockstep=lockstep)
    clock.observe(1000, 100.0)
    assert not clock.is_gone(1e6)


def test_before_the_first_block_no_time_passes():
    clock = Clock(1e6, paced=True)
    assert clock.now(500.0) == 0
    clock.observe(5000, 600.0)
    assert clock.now(600.0) == 0.005


@given(
    st.sampled_from([(True, False), (False, False), (False, True)]),
    st.lists(st.tuples(st.integers(0, 10_000), st.floats(0, 0.3), st.booleans()), max_size=40),
)
def test_it_never_goes_back(kind, steps):
    clock = Clock(1e5, *kind)
    host_s, end, latest = 0.0, 0, 0.0
    for n, pause_s, is_block in steps:
        host_s += pause_s
        if is_block:
            end += n
            clock.observe(end, host_s)
        now = clock.now(host_s)
        assert now >= max(latest, end / 1e5)
        latest = now


BLOCK_S = 1e-3
BEGAN_S = 100.0
"""Host time at which the stream began."""


class Paced:
    """A paced stream of blocks; each arrives a delay after its last sample."""

    def __init__(self):
        self.clock = Clock(1e6, paced=True)
        self.end = 0
        self.host_s = 0.0

    def block(self, delay_s, lost=0):
        """Deliver the next block after `lost` lost ones; returns the clock's time then."""
        self.end += round(BLOCK_S * 1e6)
        self.host_s = max(self.host_s, BEGAN_S + self.end / 1e6 + lost * BLOCK_S + delay_s)
        self.clock.observe(self.end, self.host_s)
        return self.clock.now(self.host_s)


@pytest.mark.parametrize("seed", range(5))
def test_late_blocks_neither_set_time_back_nor_hold_it_up(seed):
    rng, stream = Random(seed), Paced()
    stream.block(2e-4)
    for i in range(3000):
        now = stream.block(2e-4 + (rng.uniform(0, 0.02) if 10 <= i % 53 < 30 else 0.0))
        assert now == pytest.approx(stream.host_s - BEGAN_S - 2e-4, abs=1e-9), f"{i}, seed {seed}"


@given(st.integers(1, 1500), st.integers(1, 20))
def test_samples_that_are_lost_are_told_from_late_blocks_within_half_a_second(n_before, lost):
    stream, latest = Paced(), 0.0
    for _ in range(n_before):
        latest = stream.block(2e-4)
    shifted_at = stream.host_s
    for _ in range(600):
        now = stream.block(2e-4, lost)
        assert now >= latest
        latest = now
        since_s, told_s = stream.host_s - shifted_at, stream.host_s - BEGAN_S - 2e-4
        # Lately is 0.25 to 0.5 s ago; a block more until it is looked at.
        if since_s <= 0.25:
            assert now == pytest.approx(told_s, abs=1e-9)
        elif since_s > 0.5 + (lost + 2) * BLOCK_S:
            assert now == pytest.approx(told_s - lost * BLOCK_S, abs=1e-9)


def test_a_shorter_delay_is_believed_at_once():
    stream = Paced()
    for _ in range(100):
        stream.block(5e-3)
    for _ in range(6):
        now = stream.block(2e-4)
    assert now == pytest.approx(stream.host_s - BEGAN_S - 2e-4, abs=1e-9)


def test_after_half_a_second_of_silence_delays_of_before_count_no_more():
    stream = Paced()
    for _ in range(100):
        stream.block(2e-4)
    now = stream.block(2e-4, lost=600)
    assert now == pytest.approx(stream.end / 1e6, abs=1e-9)
