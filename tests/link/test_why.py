"""The text of `why`, word by word."""

import re

import pytest

from sdrlinkd.link import Outcome, Overrides, Qos, QueueParams, Told, TopicPolicy
from tests.link.world import make_link, next_burst

FILE = Told("etc/sdrlinkd.toml", ())


def pass_time(link, n, rate_hz, begin=0.0):
    """Submit `n` messages and send what may leave; returns the end time."""
    for i in range(n):
        now = begin + i / rate_hz
        link.submit(0, bytes(40), now)
        link.handle_timers(now)
        if burst := next_burst(link, now):
            link.confirm(burst, Outcome.SENT, now)
    return begin + n / rate_hz


def test_a_throttled_topic():
    link = make_link(pdu_size=64)
    policy = TopicPolicy(period_s=0.1, qos="latency", lifespan_s=0.3, weight=2)
    link.set_policies({0: policy})
    now = pass_time(link, 500, 50)
    assert link.why(0, FILE, now) == [
        (
            "odom: class latency, priority 64, to everyone, weight 2, lifespan 300 ms "
            "(etc/sdrlinkd.toml)"
        ),
        "last minute: 500 messages in, 100 sent (20 %)",
        "80 % throttled to 10 Hz by etc/sdrlinkd.toml (tx_throttled, 400)",
    ]
    link.set_policy(0, TopicPolicy(period_s=1.0, qos="latency"))
    now = pass_time(link, 500, 50, begin=now)
    told = link.why(0, Told("etc/sdrlinkd.toml", {"period_s"}), now)
    assert told[0].endswith("(etc/sdrlinkd.toml; set while running: period_s)")
    assert any("throttled to 1 Hz by sdrlinkctl set" in line for line in told)


def test_drops_under_a_policy_that_is_no_longer_set():
    link = make_link(pdu_size=64)
    link.set_policies({0: TopicPolicy(period_s=0.1, depth=1)})
    for i in range(200):
        link.submit(0, bytes(40), i * 0.06)
        link.handle_timers(i * 0.06)
    link.set_policy(0, TopicPolicy())
    told = link.why(0, Told("etc/sdrlinkd.toml", {"period_s", "depth"}), 12.0)
    assert any(
        "throttled by a period that is no longer set (tx_throttled, " in each for each in told
    )
    assert any("by a depth that is no longer set (tx_superseded, " in each for each in told)


@pytest.mark.slow
def test_a_topic_that_is_shed_says_what_the_air_was_used_for():
    link = make_link(pdu_size=64, queue=QueueParams(max_messages=10))
    link.set_policies({0: TopicPolicy(qos="bulk"), 1: TopicPolicy(qos="urgent")})
    now = 0.0
    for i in range(3000):
        now = i * 0.004
        link.submit(1, bytes(150), now)
        link.submit(0, bytes(40), now, Overrides(Qos.BULK))
        link.handle_timers(now)
        if burst := next_burst(link, now):
            link.confirm(burst, Outcome.SENT, now)
    told = link.why(0, FILE, now)
    assert any("% shed: " in line for line in told)
    assert re.match(r"this robot's own airtime: urgent \S+ %, bulk \S+ %; a full chan", told[-2])
    assert told[-1] == "the channel was full (ours 100 %, others' 0 %)"


def test_a_topic_of_which_nothing_comes():
    link = make_link(pdu_size=64)
    assert link.why(0, FILE, 0.0)[1] == "no local program has sent a message yet"
    pass_time(link, 10, 10)
    now = 0.0
    for i in range(80):
        now = 1.0 + i
        link.handle_timers(now)
    assert link.why(0, FILE, now)[1] == "no local program sent a message in the last minute"
