"""How long messages are worth sending: by their own lifespan, their topic's, their class's."""

import pytest

from sdrlinkd.config import parse_config
from sdrlinkd.link import (
    ClassesParams,
    LatencyParams,
    Opportunity,
    Outcome,
    Overrides,
    Qos,
    Told,
    TopicPolicy,
)
from tests.link.world import compose_at, make_link, next_burst, send_all, tell, topic_of

INFINITE = float("inf")
BY_CLASS = {Qos.URGENT: 1.0, Qos.LATENCY: 2.0, Qos.DEFAULT: INFINITE, Qos.BULK: INFINITE}
FILE = Told("robot.toml", ())


def outlives(link, after_s, **wishes):
    """Whether a message of topic 0 is still sent `after_s` after it was submitted."""
    link.submit(0, bytes(40), 0.0, Overrides(**wishes))
    link.handle_timers(after_s)
    sent = bool(send_all(link, after_s))
    assert link.audit() == []
    assert topic_of(link, 0).dropped == ({} if sent else {"tx_expired": 1})
    return sent


@pytest.mark.parametrize(("qos", "lifespan_s"), BY_CLASS.items())
def test_each_class_has_a_lifespan_of_its_own(qos, lifespan_s):
    asked = {"qos": qos}
    for policy, wishes in ((TopicPolicy(qos=qos.label), {}), (TopicPolicy(), asked)):
        for after_s in (0.9, 1.1, 1.9, 2.1, 3600.0):
            link = make_link()
            link.set_policies({0: policy})
            assert outlives(link, after_s, **wishes) == (after_s < lifespan_s)


def test_the_topic_goes_before_the_class_and_the_message_before_both():
    own = TopicPolicy(qos="latency", lifespan_s=5.0)
    for policy, wishes, lifespan_s in (
        (own, {}, 5.0),
        (TopicPolicy(qos="urgent", lifespan_s=INFINITE), {}, INFINITE),
        (own, {"lifespan_s": 9.0}, 9.0),
        (own, {"lifespan_s": 0.5}, 0.5),
        (own, {"qos": Qos.URGENT}, 5.0),
        (TopicPolicy(qos="latency"), {"qos": Qos.BULK}, INFINITE),
        (TopicPolicy(qos="latency"), {"lifespan_s": 9.0}, 9.0),
    ):
        for after_s in (0.4, 0.6, 4.9, 5.1, 8.9, 9.1):
            link = make_link()
            link.set_policies({0: policy})
            assert outlives(link, after_s, **wishes) == (after_s < lifespan_s)


def test_the_class_says_nothing_of_what_is_kept_for_those_who_come_late():
    kept = TopicPolicy(qos="latency", durability="transient_local")
    link = make_link()
    link.set_policies({0: kept})
    link.submit(0, bytes(40), 0.0)
    assert len(send_all(link, 0.0)) == 1
    tell(link, 2, at=60.0)
    for now in (60.0, 61.0, 62.0, 63.0):
        link.handle_timers(now)
    assert len(send_all(link, 63.0)) == 1
    # Its topic has one.
    link.set_policy(0, TopicPolicy(qos="latency", durability="transient_local", lifespan_s=5.0))
    tell(link, 3, at=70.0)
    for now in (70.0, 71.0, 72.0, 73.0):
        link.handle_timers(now)
    assert send_all(link, 73.0) == []


def test_what_the_producer_allows_holds_for_newcomers_too():
    link = make_link()
    link.set_policies({0: TopicPolicy(durability="transient_local", lifespan_s=5.0)})
    link.submit(0, bytes(40), 0.0, Overrides(lifespan_s=100.0))
    send_all(link, 0.0)
    tell(link, 2, at=60.0)
    for now in (60.0, 61.0, 62.0, 63.0):
        link.handle_timers(now)
    assert len(send_all(link, 63.0)) == 1


@pytest.mark.parametrize(
    ("qos", "size", "age_s", "ended"),
    [
        (Qos.URGENT, 29_000, 0.0, None),
        (Qos.URGENT, 31_000, 0.0, "tx_too_slow"),
        (Qos.URGENT, 21_000, 0.1, "tx_too_slow"),
        # What is no command is finished once it has begun.
        (Qos.LATENCY, 31_000, 0.0, None),
    ],
)
def test_a_command_that_cannot_arrive_in_time_is_refused_at_once(qos, size, age_s, ended):
    link = make_link(pdu_size=200)
    compose_at(link, 100_000)
    wishes = Overrides(qos=qos, lifespan_s=0.3, age_s=age_s)
    assert link.submit(0, bytes(size), 1.0, wishes) == ended
    why = link.why(0, FILE, 1.0)
    assert any("the last one needs 0.8" in line for line in why) == (ended is not None)
    assert link.audit() == []


def test_a_beacon_at_the_slowest_rate_does_not_make_commands_too_slow():
    link = make_link(pdu_size=200, beacon_s=1.0)
    compose_at(link, 100_000)
    slow = Opportunity(5.0, lambda _, n: n * 0.1, lambda *_: 8)
    assert link.next_burst(slow) is not None, "a beacon"
    assert link.submit(0, bytes(20_000), 5.0, Overrides(qos=Qos.URGENT, lifespan_s=0.3)) is None


def test_nothing_changes_for_a_topic_that_nobody_configured():
    assert outlives(make_link(), 3600.0)


def test_a_receiver_leaves_the_classes_lifespan_to_the_sender():
    """The producer may have requested more, which the receiver cannot know."""
    sender, receiver = make_link(1), make_link(2)
    for link in (sender, receiver):
        link.set_policies({0: TopicPolicy(qos="latency")})
    sender.submit(0, bytes(40), 0.0, Overrides(lifespan_s=60.0))
    (pdu,) = send_all(sender, 9.0)
    assert len(receiver.hear(pdu, 9.0)) == 1


def test_the_class_may_have_another_or_none():
    for lifespan_s in (0.2, 30.0, INFINITE):
        classes = ClassesParams(latency=LatencyParams(lifespan_s=lifespan_s))
        for after_s in (0.1, 0.3, 29.0, 31.0):
            link = make_link(classes=classes)
            link.set_policies({0: TopicPolicy(qos="latency")})
            assert outlives(link, after_s) == (after_s < lifespan_s)


def test_another_key_of_a_class_leaves_its_lifespan_and_share():
    classes = parse_config("[classes.latency]\nparity = 0.1\n[classes.urgent]\nshare = 0.1").classes
    assert (classes.latency.share, classes.latency.lifespan_s) == (0.1, 2.0)
    assert classes.urgent.lifespan_s == 1.0


def test_why_and_the_report_tell_which():
    link = make_link(pdu_size=64)
    policies = {
        0: TopicPolicy(qos="latency"),
        1: TopicPolicy(qos="latency", lifespan_s=0.5),
    }
    link.set_policies(policies)
    for now in (0.0, 0.5, 1.0, 3.0, 4.0):
        link.handle_timers(now)
        if now == 0.0:
            link.submit(0, bytes(40), now)
            link.submit(1, bytes(40), now)
            link.submit(2, bytes(40), now, Overrides(lifespan_s=0.1))
    link.handle_timers(4.0)
    first, *rest = link.why(0, FILE, 4.0)
    assert first == (
        "odom: class latency, priority 64, to everyone, lifespan 2 s from its class (robot.toml)"
    )
    assert (
        "100 % expired in the queue: older than 2 s, the lifespan of class latency (tx_expired, 1)"
    ) in rest
    own = link.why(1, FILE, 4.0)
    assert "lifespan 500 ms (robot.toml)" in own[0]
    assert "100 % expired in the queue: older than 500 ms (tx_expired, 1)" in own
    asked = link.why(2, FILE, 4.0)
    assert "lifespan" not in asked[0]
    assert any("older than their producer allows" in line for line in asked)
    report = link.report(4.0)
    assert [(each.lifespan_s, each.lifespan_from) for each in report.topics] == [
        (2.0, "class"),
        (0.5, "topic"),
        (None, ""),
    ]


@pytest.mark.slow
def test_an_overloaded_air_hands_over_nothing_old_of_class_latency():
    """Twice as many messages are submitted as the air can carry."""
    sender, receiver = make_link(1, pdu_size=64), make_link(2, pdu_size=64)
    for link in (sender, receiver):
        link.set_policies({0: TopicPolicy(qos="latency")})
    ages = []
    for step in range(10_000):
        now = step * 0.001
        sender.submit(0, bytes(30), now)
        if step % 20:
            continue
        sender.handle_timers(now)
        burst = next_burst(sender, now)
        sender.confirm(burst, Outcome.SENT, now)
        for pdu in burst.pdus:
            ages += [receiver.delivered(each, now) for each in receiver.hear(pdu, now)]
    assert len(ages) > 1000
    assert 1.9 < max(ages) <= 2.0
    assert topic_of(sender, 0).dropped["tx_expired"] > 0
    assert sender.audit() == []
