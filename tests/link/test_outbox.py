"""What waits, what is shed, and that no equal starves."""

import pytest

from sdrlinkd.link import Outcome, Overrides, Qos, QueueParams, TopicPolicy
from tests.link.world import compose, layouts, make_link, records_in, send_all, topic_of, tx


def dropped(link):
    counts = {}
    for topic in link.registry.topics:
        for reason, count in topic_of(link, topic.id).dropped.items():
            counts[topic.name, reason] = count
    return counts


def payloads_left(link):
    from sdrlinkd.wire import parse

    pdus = send_all(link)
    return [e.payload for pdu in pdus for e in parse(pdu, 64).entries if e.topic_id != 15]


def test_depth_one_means_the_latest_wins():
    link = make_link(pdu_size=64)
    link.set_policies({0: TopicPolicy(depth=1, stamp=False)})
    for i in range(5):
        link.submit(0, bytes([i]) * 8, 0.0)
    assert payloads_left(link) == [bytes([4]) * 8]
    assert dropped(link) == {("odom", "tx_superseded"): 4}
    assert link.audit() == []


def test_a_message_in_fragments_is_not_superseded():
    link = make_link(pdu_size=64)
    link.set_policies({0: TopicPolicy(depth=1, stamp=False)})
    link.submit(0, b"a" * 100, 0.0)
    link.confirm(compose(link, 0.0, 1), Outcome.SENT, 0.0)
    link.submit(0, b"b" * 8, 0.0)
    link.submit(0, b"c" * 8, 0.0)
    assert payloads_left(link) == [b"a" * 49, b"c" * 8]


def test_overflow_sheds_the_lowest_class_oldest_first():
    link = make_link(pdu_size=64, queue=QueueParams(max_messages=3))
    link.submit(0, b"d1" * 4, 0.0)
    link.submit(1, b"b1" * 4, 1.0, Overrides(qos=Qos.BULK))
    link.submit(1, b"b2" * 4, 2.0, Overrides(qos=Qos.BULK))
    assert link.submit(0, b"d2" * 4, 3.0) is None
    assert dropped(link) == {("scan", "tx_overflow_old"): 1}
    assert link.submit(2, b"u1" * 4, 4.0, Overrides(qos=Qos.URGENT)) is None
    assert dropped(link) == {("scan", "tx_overflow_old"): 2}
    assert link.submit(1, b"b3" * 4, 5.0, Overrides(qos=Qos.BULK)) == "tx_overflow_new"
    assert link.audit() == []


def test_bytes_are_bounded_too():
    link = make_link(queue=QueueParams(max_bytes=1000))
    for _ in range(5):
        link.submit(0, bytes(400), 0.0)
    assert tx(link).queued_bytes == 800
    assert link.submit(0, bytes(1001), 0.0) == "tx_overflow_new"
    assert tx(link).queued_bytes == 800


def test_expired_messages_are_not_sent():
    link = make_link(pdu_size=64)
    link.submit(0, bytes(8), 0.0, Overrides(lifespan_s=1.0))
    link.submit(0, bytes(9), 0.0, Overrides(lifespan_s=2.0))
    assert [pdu[0][3] for pdu in layouts(send_all(link, now=1.0), 64)] == [9]
    assert dropped(link) == {("odom", "tx_expired"): 1}


@pytest.mark.parametrize("age_s", [1.0, 12.0, 3600.0])
def test_a_message_that_is_too_old_when_it_comes_expires_at_once(age_s):
    """However old it is, it does not displace a fresh one."""
    link = make_link(pdu_size=64)
    link.set_policies({0: TopicPolicy(depth=1, lifespan_s=0.3)})
    assert link.submit(0, bytes(8), 0.0) is None
    assert link.submit(0, bytes(9), 0.0, Overrides(age_s=age_s, receipt="old")) == "tx_expired"
    assert [pdu[0][3] for pdu in layouts(send_all(link, now=0.1), 64)] == [8]
    assert dropped(link) == {("odom", "tx_expired"): 1}
    assert [(each.receipt, each.fate) for each in link.take_verdicts()] == [("old", "expired")]
    assert link.audit() == []


@pytest.mark.parametrize(("age_s", "told_us"), [(9.0, 9_000_000), (12.0, 0), (3600.0, 0)])
def test_without_a_lifespan_great_ages_count_from_now(age_s, told_us):
    """A replayed recording, or another clock."""
    link = make_link(pdu_size=64)
    link.submit(0, bytes(8), 0.0, Overrides(age_s=age_s))
    (pdu,) = send_all(link)
    assert [each.age_us for each in records_in(pdu, 64)] == [told_us]


def test_a_long_lifespan_bears_a_great_age():
    link = make_link(pdu_size=64)
    link.submit(0, bytes(8), 0.0, Overrides(age_s=12.0, lifespan_s=60.0))
    (pdu,) = send_all(link)
    assert [each.age_us for each in records_in(pdu, 64)] == [12_000_000]


def test_what_has_begun_is_finished_whatever_its_lifespan():
    link = make_link(pdu_size=64)
    for _ in range(2):
        link.submit(0, bytes(200), 0.0, Overrides(lifespan_s=0.4))
    begun = compose(link, 0.3, 2)
    link.confirm(begun, Outcome.SENT, 0.31)
    rest = send_all(link, now=0.7)
    assert len(begun.pdus) + len(rest) == 5
    assert topic_of(link, 0).sent == 1
    assert dropped(link) == {("odom", "tx_expired"): 1}
    assert link.audit() == []


def test_a_beginning_that_never_left_does_not_outlive_the_lifespan():
    """As the radio or the whole process stood still: the first burst came too late, or not yet."""
    for comes_back in (True, False):
        link = make_link(pdu_size=64)
        link.submit(0, bytes(200), 0.0, Overrides(lifespan_s=0.4))
        burst = compose(link, 0.3, 2)
        if comes_back:
            link.confirm(burst, Outcome.LATE, 0.8)
        assert compose(link, 3.0, 8) is None
        if not comes_back:
            link.confirm(burst, Outcome.LATE, 3.0)
        assert dropped(link) == {("odom", "tx_expired"): 1}
        assert not link.has_work
        assert link.audit() == []


@pytest.mark.parametrize(
    ("policy", "qos"), [(TopicPolicy(deadman_s=1.0), None), (TopicPolicy(), Qos.URGENT)]
)
def test_the_rest_of_an_expired_command_is_withdrawn(policy, qos):
    link = make_link(pdu_size=64)
    link.set_policies({0: policy})
    link.submit(0, bytes(200), 0.0, Overrides(qos, lifespan_s=1.0))
    burst = compose(link, 0.5, 2)
    assert compose(link, 1.5, 8) is None
    assert link.audit() == []
    link.confirm(burst, Outcome.SENT, 1.6)
    assert topic_of(link, 0).sent == 0
    assert dropped(link) == {("odom", "tx_expired"): 1}
    assert link.audit() == []


def test_timers_expire_what_no_burst_looked_at():
    link = make_link()
    link.submit(0, bytes(8), 0.0, Overrides(lifespan_s=1.0))
    link.handle_timers(1.5)
    assert tx(link).queued == 0


@pytest.mark.parametrize("outcome", [Outcome.UNDERFLOW, Outcome.LOST])
def test_a_burst_that_did_not_leave_drops_its_messages_by_name(outcome):
    link = make_link(pdu_size=64)
    link.submit(0, bytes(200), 0.0)
    link.confirm(compose(link, 0.0, 1), outcome, 0.1)
    assert dropped(link) == {("odom", "tx_radio_failed"): 1}
    assert compose(link, 0.2, 8) is None
    assert link.audit() == []


def test_shut_down_drops_the_rest_by_name():
    link = make_link(pdu_size=64)
    for _ in range(3):
        link.submit(0, bytes(200), 0.0)
    compose(link, 0.0, 1)
    link.shut_down()
    assert dropped(link) == {("odom", "tx_shutdown"): 3}
    assert link.audit() == []


def test_equals_take_turns_however_much_one_sends():
    link = make_link(pdu_size=64, greedy=False)
    for _ in range(50):
        link.submit(0, bytes(51), 0.0)
    for _ in range(3):
        link.submit(1, bytes(51), 0.0)
    carriers = [
        i for i, pdu in enumerate(layouts(send_all(link), 64)) if any(e[0] == 1 for e in pdu)
    ]
    assert len(carriers) == 9
    assert carriers[-1] <= 9


def test_a_topic_without_a_free_entry_id_waits_and_others_go_on():
    link = make_link(pdu_size=64, greedy=False)
    link.set_policies({i: TopicPolicy(stamp=False) for i in range(3)})
    for _ in range(260):
        link.submit(0, bytes(60), 0.0)
    link.submit(1, bytes(60), 0.0)
    sent = layouts(send_all(link, now=0.0), 64)
    assert sum(1 for pdu in sent for entry in pdu if entry[0] == 0 and entry[1] == 0) == 256
    assert any(entry[0] == 1 for pdu in sent for entry in pdu)
    assert tx(link).queued == 4
    assert any("odom had to wait" in notice for notice in link.notices(0.0))
    assert link.next_wakeup(0.0) == pytest.approx(0.625)
    send_all(link, now=0.625)
    assert tx(link).queued == 0


def test_nothing_is_shed_for_a_message_that_cannot_fit_anyway():
    link = make_link(queue=QueueParams(max_bytes=1000))
    link.submit(0, bytes(10), 0.0, Overrides(qos=Qos.BULK))
    link.submit(0, bytes(950), 0.0, Overrides(qos=Qos.URGENT))
    assert link.submit(0, bytes(500), 0.0) == "tx_overflow_new"
    assert tx(link).queued == 2
    link.set_policies({1: TopicPolicy(depth=1)})
    link.submit(1, bytes(8), 0.0)
    assert link.submit(1, bytes(1001), 0.0) == "tx_overflow_new"
    assert tx(link).queued == 3


def test_lanes_that_wait_for_ids_hold_up_no_lower_level():
    link = make_link(pdu_size=64)
    link.set_policies({i: TopicPolicy(stamp=False) for i in range(3)})
    for i in range(340):
        link.submit(0, bytes(60), 0.0, Overrides(priority=100, dst=i % 255))
    send_all(link)
    assert tx(link).queued == 84
    link.submit(1, bytes(20), 0.0, Overrides(qos=Qos.BULK))
    assert len(send_all(link)) == 1
    assert link.next_wakeup(0.0) == pytest.approx(0.625)
