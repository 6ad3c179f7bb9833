"""A message's life: which steps there are, and who may take them."""

import itertools
from random import Random

import pytest

from sdrlinkd.link import LinkParams, Lives, Outbox, Qos, QueueParams
from sdrlinkd.link.queue import (
    DEFAULT_POLICY,
    STEPS,
    Fate,
    IllegalStepError,
    Outgoing,
    Step,
    TxTally,
)
from sdrlinkd.link.schedule import ClassesParams
from sdrlinkd.link.transmit import Sender
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
        made.step(step)
    return made


@pytest.mark.parametrize(("fate", "step"), [*itertools.product(Fate, Step)])
def test_every_step_is_allowed_or_raises(fate, step):
    made = message(LEADING_TO[fate])
    assert made.fate is fate
    if (fate, step) in STEPS:
        made.step(step)
        assert made.fate is STEPS[fate, step]
        return
    with pytest.raises(IllegalStepError, match=f"{step.name} where a message is {fate.name}"):
        made.step(step)
    assert made.fate is fate


def test_nothing_leaves_an_end():
    assert {fate for fate, _ in STEPS} == {Fate.QUEUED, Fate.IN_FLIGHT}


def test_in_the_field_an_illegal_step_is_counted_told_and_changes_nothing(monkeypatch):
    monkeypatch.setattr(Lives, "is_strict", False)
    registry = make_registry([("odom", "nav_msgs/msg/Odometry")])
    sender = Sender(LinkParams(), QueueParams(), registry, 1, Random(1), 0.5, ClassesParams(), {})
    assert sender.audit() == []
    made = message([Step.DROP])
    sender.lives.drop(made, "tx_expired")
    assert (sender.lives.illegal_steps, made.tally.dropped) == (1, {})
    assert sender.audit() == ["tx messages: 1 illegal steps"]


def test_a_queue_says_why_it_takes_a_message_or_not():
    outbox = Outbox(QueueParams(max_messages=1))
    first, second = message(), message()
    assert outbox.put(first, DEFAULT_POLICY) is None
    assert outbox.put(second, DEFAULT_POLICY) is None
    assert (first.fate, first.tally.dropped) == (Fate.DROPPED, {"tx_overflow_old": 1})
    assert second.fate is Fate.QUEUED
