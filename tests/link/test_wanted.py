"""Demand: which of a robot's declared topics consumers at other robots subscribe to."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import Offer
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
