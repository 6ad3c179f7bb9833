"""Demand: which of a robot's declared topics consumers at other robots subscribe to."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import Offer, Overrides, TopicPolicy
from sdrlinkd.link.topics import LEASE_S, Demand, OwnTopics, Wants
from sdrlinkd.wire import Registry, Wanted
from tests.laws import law
from tests.link.declared import auto, run, step

CDR = b"\0\1\0\0"


def team(n_topics, n_robots=2, **more):
    links = [auto(i + 1, **more) for i in range(n_robots)]
    for i in range(n_topics):
        links[0].declare(Offer(f"sensors/number_{i}", "std_msgs/msg/String"))
    run(links, 0.0, 200)
    return links


def base_of(link, name):
    return next(topic.base for topic in link.heard_topics()[1] if topic.name == name)


@pytest.mark.parametrize("pdu_size", [64, 512])
def test_twelve_of_sixty_topics_are_wanted_as_long_as_somebody_wants_them(pdu_size):
    links = team(60, 2, pdu_size=pdu_size)
    one, two = links
    names = sorted(f"sensors/number_{5 * i}" for i in range(12))
    assert one.demand(10.0) == {}
    two.want([(1, base_of(two, name)) for name in names])
    run(links, 10.0, 10)
    assert one.demand(10.5) == {name: [2] for name in names}, "at once"
    run(links, 10.5, 200)
    assert one.demand(20.5) == {name: [2] for name in names}
    two.want([(1, base_of(two, names[0]))])
    run(links, 20.5, 80)
    assert one.demand(24.5) == {names[0]: [2]}


def test_a_robot_that_falls_silent_wants_nothing_any_more():
    links = team(3, 3)
    one, two, three = links
    two.want([(1, base_of(two, "sensors/number_0"))])
    three.want([(1, base_of(three, "sensors/number_0"))])
    run(links, 10.0, 20)
    assert one.demand(11.0) == {"sensors/number_0": [2, 3]}
    run([one, three], 11.0, 80)
    assert one.demand(15.0) == {"sensors/number_0": [3]}
    assert one.demand(15.0 + LEASE_S) == {}


def test_a_loss_of_a_fifth_of_the_pdus_does_not_end_a_lease():
    links, rng = team(3), Random(1)
    one, two = links
    two.want([(1, base_of(two, "sensors/number_2"))])
    run(links, 10.0, 20)
    for i in range(600):
        step(links, 11.0 + 0.05 * i, lambda: rng.random() < 0.2)
        assert one.demand(11.0 + 0.05 * i), i


def test_any_number_of_any_robot_is_a_lease_or_nothing():
    topics = OwnTopics(Registry(()), True, 250)
    number = topics.declare(Offer("odom", "nav_msgs/msg/Odometry")).id

    @law(200)
    @given(st.lists(st.tuples(st.integers(0, 254), st.binary(max_size=20)), max_size=20))
    def holds(heard):
        demand = Demand(topics)
        for src, numbers in heard:
            demand.hear(src, Wanted(1, numbers), 0.0)
        robots = sorted({src for src, numbers in heard if number in numbers})
        assert demand.wanted(1.0) == ({"odom": robots} if robots else {})
        assert demand.wanted(LEASE_S) == {}

    holds()


def test_subscriptions_that_come_and_go_do_not_fill_the_air():
    wants = Wants(100)
    told = 0
    for i in range(1000):
        wants.set([(1, 16 + i % 200)])
        told += len(wants.due(0.01 * i, {1}))
    assert told <= 101, "at most every 0.1 s"
    wants.set([])
    assert wants.due(100.0, {1}) == []
    wants.set([(src, number) for src in (1, 2) for number in range(16, 256)])
    assert [each.node for each in wants.due(200.0, {2})] == [2, 2, 2], "those that are heard"
    found = wants.due(300.0, {1, 2})
    assert [(each.node, len(each.topics)) for each in found] == [
        (1, 100), (1, 100), (1, 40), (2, 100), (2, 100), (2, 40),
    ]  # fmt: skip


def submitted(link, topic_id, now, period_s, n, **more):
    """How many of n messages, one each `period_s`, are taken."""
    return sum(
        link.submit(topic_id, CDR, now + i * period_s, Overrides(**more)) is None for i in range(n)
    )


def slowed(*policies):
    """A robot of whose one topic another wants a message in 10 s; and the topic's number."""
    links = team(1)
    one, two = links
    wanted = 1, base_of(two, "sensors/number_0")
    number = one.topic_named("sensors/number_0").id
    one.set_policies(dict.fromkeys([number], *policies) if policies else {})
    two.want([wanted], {wanted: 10.0})
    run(links, 10.0, 20)
    return links, wanted, number


def test_consumers_get_as_many_as_they_ask_for_and_all_once_they_ask_for_all():
    (one, two), wanted, number = slowed()
    assert submitted(one, number, 11.0, 0.1, 10) == 1
    two.want([wanted], {wanted: 0.2})
    run([one, two], 12.0, 20)
    assert submitted(one, number, 13.0, 0.1, 10) == 5
    two.want([wanted])
    run([one, two], 14.0, 80)
    assert submitted(one, number, 14.0 + LEASE_S + 1.0, 0.1, 10) == 10


def test_a_rate_holds_for_each_producer_of_a_topic():
    (one, _), _, number = slowed()
    for key in ("camera", "lidar"):
        assert submitted(one, number, 11.0, 0.1, 10, key=key) == 1


@pytest.mark.parametrize("more", [{"dst": 2}, {"receipt": "mine"}])
def test_what_somebody_waits_for_is_not_slowed(more):
    (one, _), _, number = slowed()
    assert submitted(one, number, 11.0, 0.1, 10, **more) == 10


@pytest.mark.parametrize(
    "policy", [TopicPolicy(deadman_s=1.0), TopicPolicy(durability="transient_local")]
)
def test_what_must_arrive_is_not_slowed(policy):
    (one, _), _, number = slowed(policy)
    assert submitted(one, number, 11.0, 0.1, 10) == 10


def test_no_consumer_can_ask_for_less_than_a_message_a_minute():
    (one, two), wanted, number = slowed()
    two.want([wanted], {wanted: 1e6})
    run([one, two], 12.0, 20)
    assert submitted(one, number, 13.0, 10.0, 13) == 3
