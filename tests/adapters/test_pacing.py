"""Replay at the recorded pace or another."""

import pytest

from sdrlinkd.adapters import BagMessage, first_seconds, paced


class FakeTime:
    """A clock that advances by sleeping."""

    def __init__(self):
        self.now = 100.0
        self.sleeps = []

    def clock(self):
        return self.now

    def sleep(self, seconds):
        assert seconds > 0
        self.sleeps.append(seconds)
        self.now += seconds


def at(*seconds):
    return [BagMessage("/a", "b/msg/C", round(s * 1e9), b"") for s in seconds]


def played(messages, rate, dawdle=None):
    fake, seen = FakeTime(), []
    for i, _ in enumerate(paced(messages, rate, fake.clock, fake.sleep)):
        seen.append(round(fake.now - 100, 6))
        fake.now += (dawdle or {}).get(i, 0)
    return seen, fake.sleeps


@pytest.mark.parametrize("rate", [0.5, 1, 2, 10])
def test_each_at_its_time_over_the_rate(rate):
    seen, _ = played(at(5, 5.5, 6, 9), rate)
    assert seen == [0, round(0.5 / rate, 6), round(1 / rate, 6), round(4 / rate, 6)]


def test_at_once_when_the_rate_is_infinite():
    assert played(at(5, 6, 7000), float("inf")) == ([0, 0, 0], [])


def test_a_late_message_delays_no_other():
    seen, sleeps = played(at(5, 6, 7, 9), 2.0, dawdle={1: 0.8})
    assert seen == [0.0, 0.5, 1.3, 2.0]
    assert sleeps == [pytest.approx(0.5), pytest.approx(0.7)]


def test_small_delays_do_not_add_up():
    messages = at(*(i / 10 for i in range(1000)))
    seen, _ = played(messages, 1.0, dawdle=dict.fromkeys(range(1000), 0.01))
    assert seen == [round(i / 10, 6) for i in range(1000)]


def test_equal_and_earlier_times_go_at_once():
    assert played(at(5, 5, 6, 5.5, 7), 1.0)[0] == [0, 0, 1, 1, 2]


def test_messages_are_taken_only_when_due():
    fake, taken = FakeTime(), []

    def source():
        for message in at(0, 1, 2):
            taken.append(message.time_ns)
            yield message

    messages = paced(source(), 1.0, fake.clock, fake.sleep)
    next(messages)
    assert len(taken) == 1
    next(messages)
    assert len(taken) == 2


@pytest.mark.parametrize(
    ("seconds", "kept"), [(1.0, 2), (1.001, 3), (0.5, 1), (100, 4), (float("inf"), 4), (0, 0)]
)
def test_first_seconds_end_before_the_limit(seconds, kept):
    messages = at(5, 5.5, 6, 6.01)
    assert list(first_seconds(messages, seconds)) == messages[:kept]


def test_nothing_in_nothing_out():
    assert list(paced([], 1.0)) == []
    assert list(first_seconds([], 1.0)) == []
