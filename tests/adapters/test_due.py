"""A recording as a plan: times relative to its first message, of the selected topics."""

from itertools import pairwise

import pytest

from sdrlinkd.adapters import BagMessage, BuiltInRobot, Due, due_messages

IDS = {"/a": 4, "/b": 0}


class Recording:
    """Messages (topic, time in s, payload); counts how many were taken."""

    def __init__(self, *messages):
        self._messages = messages
        self.taken = 0

    def messages(self):
        for topic, at, payload in self._messages:
            self.taken += 1
            yield BagMessage(topic, "x/msg/Y", round(at * 1e9), payload)


FIVE = (
    ("/a", 1000.0, b"one"),
    ("/b", 1000.25, b"two"),
    ("/a", 1000.25, b"three"),
    ("/c", 1000.5, b"four"),
    ("/a", 1001.0, b"five"),
)


def plan(messages, duration_s=100.0, begin_s=0.0, ids=IDS):
    return list(due_messages(Recording(*messages), duration_s, begin_s, ids))


def test_each_is_due_as_long_after_the_first_as_it_was_recorded():
    assert plan(FIVE) == [
        Due(0.0, 4, b"one"),
        Due(0.25, 0, b"two"),
        Due(0.25, 4, b"three"),
        Due(1.0, 4, b"five"),
    ]


def test_the_beginning_moves_all_alike():
    plain, moved = plan(FIVE), plan(FIVE, begin_s=7.5)
    assert [due.at for due in moved] == [due.at + 7.5 for due in plain]
    assert [due[1:] for due in moved] == [due[1:] for due in plain]


def test_topics_without_an_id_are_left_out_but_time_counts_from_them():
    assert plan(FIVE, ids={"/b": 9}) == [Due(0.25, 9, b"two")]
    assert plan(FIVE, ids={}) == []


def test_only_the_first_seconds_are_due():
    assert [due.payload for due in plan(FIVE, duration_s=0.25)] == [b"one"]
    assert [due.payload for due in plan(FIVE, duration_s=0.26)] == [b"one", b"two", b"three"]
    assert plan(FIVE, duration_s=0.0) == []
    # Relative to the recording's start, not to the time of replay.
    assert len(plan(FIVE, duration_s=0.26, begin_s=100.0)) == 3


def test_nothing_is_due_of_nothing():
    assert plan(()) == []


def test_messages_are_taken_one_by_one():
    recording = Recording(*FIVE)
    due = due_messages(recording, 100.0, 0.0, IDS)
    assert recording.taken == 0
    next(due)
    assert recording.taken == 1


@pytest.mark.parametrize("seed", [1, 2])
def test_the_built_in_robot_has_the_same_plan_each_time(seed):
    ids = {"/robot_7/odom": 1, "/robot_7/cmd_vel": 3}

    def made(seed):
        return list(due_messages(BuiltInRobot("robot_7", 2.0, seed), 2.0, 0.5, ids))

    due = made(seed)
    assert due == made(seed) != made(seed + 1)
    assert [each.topic_id for each in due].count(1) == 60
    assert [each.topic_id for each in due].count(3) == 20
    assert due[0].at == 0.5
    assert due[-1].at < 2.5
    assert all(one.at <= other.at for one, other in pairwise(due))
    velocities = [each.at for each in due if each.topic_id == 3]
    assert velocities == [pytest.approx(0.5 + i / 10) for i in range(20)]
