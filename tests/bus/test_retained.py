"""Messages kept for consumers that subscribe later: how many, how old, and in which order."""

from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.bus.testing import OutHeader, Retained, Retention


def message(topic="map", number=1, at=0.0, size=8, age=None, **more):
    header = OutHeader(s=2, n=number, tr=0, ty="nav_msgs/msg/OccupancyGrid", age=age)
    return Retained(f"/rx_robot_2/{topic}".encode() + b"\0", header, bytes(size), at=at, **more)


def numbers(retention, prefix=b"/"):
    return [each.header.n for each in retention.matching(prefix)]


def test_the_last_of_each_series_come_in_the_order_of_their_reception():
    retention = Retention()
    for number in range(1, 7):
        key, topic = ((2, 0), "map") if number % 2 else ((2, 1), "map2")
        retention.keep(key, message(topic, number, number), 2)
    assert numbers(retention) == [3, 4, 5, 6]
    assert numbers(retention, b"/rx_robot_2/map\0") == [3, 5]
    assert numbers(retention, b"/rx_robot_2/map") == [3, 4, 5, 6]
    retention.forget_topic(1)
    assert numbers(retention) == [3, 5]
    retention.forget((2, 0))
    retention.forget((2, 0))
    assert numbers(retention) == []


def test_the_age_grows_and_what_is_too_old_is_not_given():
    kept = message(age=500_000, lifespan_s=2.0, at=7.0)
    assert kept.late(8.0).age == 1_500_000
    assert kept.late(8.0).late
    assert kept.late(9.0) is None
    unknown = message(lifespan_s=2.0, at=7.0)
    assert unknown.late(8.0).age is None
    assert unknown.late(10.0) is None
    assert message().late(1e6).late


def test_the_bound_itself_may_be_kept():
    """A message counts 512 octets more than its payload."""
    retention = Retention(most_bytes=2 * (8 + 512))
    for number in range(1, 4):
        retention.keep((2, number), message(str(number), number), 1)
        assert numbers(retention) == [1, 2, 3][max(0, number - 2) : number]


def test_what_a_newer_message_replaces_leaves_its_room():
    retention = Retention(most_bytes=3 * (8 + 512))
    retention.keep((2, 9), message("other", 100), 1)
    for number in range(9):
        retention.keep((2, 0), message("map", number), 2)
    assert numbers(retention) == [100, 7, 8]


def test_what_is_forgotten_leaves_its_room():
    retention = Retention(most_bytes=4000)
    for first in range(0, 60, 6):
        for number in range(first, first + 6):
            retention.keep((2, number % 6), message(str(number % 6), number), 1)
        assert numbers(retention) == [*range(first, first + 6)], "as many as at first"
        retention.forget_topic(5)
        for topic_id in range(5):
            retention.forget((2, topic_id))


@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 60)), max_size=40), st.integers(1, 3))
def test_it_never_keeps_more_than_its_bound(sent, depth):
    retention = Retention(most_bytes=2000)
    for number, (topic_id, size) in enumerate(sent, 1):
        retention.keep((2, topic_id), message(str(topic_id), number, number, size), depth)
        kept = list(retention.matching(b"/"))
        assert sum(len(each.payload) + 512 for each in kept) <= 2000
        assert number in numbers(retention), "the newest is always kept"
