"""A message's life: which transitions exist, and who may cause them."""

import itertools
from math import inf

import pytest

from sdrlinkd.errors import IllegalStepError
from sdrlinkd.link import LinkParams, Lives, Outbox, Qos, QueueParams
from sdrlinkd.link.queue import (
    DEFAULT_POLICY,
    STEPS,
    Fate,
    Intake,
    Outgoing,
    Step,
    TxTally,
)
from sdrlinkd.link.schedule import ClassesParams
from sdrlinkd.link.topics import OwnTopics
from sdrlinkd.wire import make_registry

LEADING_TO = {
    Fate.QUEUED: [],
    Fate.IN_FLIGHT: [Step.BEGIN],
    Fate.SENT: [Step.BEGIN, Step.LEAVE],
    Fate.DROPPED: [Step.DROP],
}


def message(steps=()):
    made = Outgoing(0, b"12345", Qos.DEFAULT, 0, 255, 0.0, 9.0, wants_stamp=False, tally=TxTally())
    for step in steps:
        assert made.step(step)
    return made


@pytest.mark.parametrize(("fate", "step"), [*itertools.product(Fate, Step)])
def test_every_step_is_allowed_or_refused(fate, step):
    made = message(LEADING_TO[fate])
    assert made.fate is fate
    assert made.step(step) == ((fate, step) in STEPS)
    assert made.fate is STEPS.get((fate, step), fate)


def test_in_tests_an_illegal_step_raises():
    lives = Lives()
    with pytest.raises(IllegalStepError):
        lives.drop(message([Step.DROP]), "tx_expired")
    with pytest.raises(IllegalStepError):
        lives.begin(message([Step.BEGIN, Step.LEAVE]))


def test_nothing_leaves_an_end():
    assert {fate for fate, _ in STEPS} == {Fate.QUEUED, Fate.IN_FLIGHT}


def test_in_the_field_an_illegal_step_is_counted_told_and_changes_nothing(monkeypatch):
    monkeypatch.setattr(Lives, "is_strict", False)
    registry = make_registry([("odom", "nav_msgs/msg/Odometry")])
    outbox = Outbox(QueueParams(), 64)
    intake = Intake(LinkParams(), OwnTopics(registry, False, 100), outbox, ClassesParams(), {})
    assert intake.audit() == []
    made = message([Step.DROP])
    outbox.lives.drop(made, "tx_expired")
    assert (outbox.lives.illegal_steps, made.tally.dropped) == (1, {})
    assert intake.audit() == ["tx messages: 1 illegal steps"]


def test_a_queue_says_why_it_takes_a_message_or_not():
    outbox = Outbox(QueueParams(max_messages=1), 64)
    first, second = message(), message()
    assert outbox.put(first, DEFAULT_POLICY, inf) is None
    assert outbox.put(second, DEFAULT_POLICY, inf) is None
    assert (first.fate, first.tally.dropped) == (Fate.DROPPED, {"tx_overflow_old": 1})
    assert second.fate is Fate.QUEUED
