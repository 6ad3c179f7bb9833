"""The queue of messages and what decides on them, each part alone."""

from collections import Counter
from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import (
    ClassesParams,
    DefaultParams,
    LinkParams,
    Outbox,
    Overrides,
    Qos,
    QueueParams,
    TopicPolicy,
)
from sdrlinkd.link.queue import (
    DEFAULT_POLICY,
    Deflated,
    Fate,
    Intake,
    Kept,
    Latched,
    Lives,
    Offer,
    Outgoing,
    Step,
    TxTally,
    balance,
    most_expanded,
    train_dictionary,
    with_first,
)
from sdrlinkd.link.queue.testing import Admission, Parting
from sdrlinkd.link.topics import OwnTopics
from sdrlinkd.wire import (
    PARTS,
    Entry,
    Part,
    Pdu,
    build,
    build_part,
    make_registry,
    max_large_size,
    part_size,
)
from tests.laws import law
from tests.link.world import outgoing

ENTRY, WITH_AGE = 5, 13
"""Octets that a message takes besides its own: alone, and with its age."""
PLENTY = QueueParams(max_messages=10_000, max_bytes=1 << 30, max_airtime_s=inf)


@pytest.mark.parametrize(
    ("policy", "given_to", "refused"),
    [
        ({}, [(0.0, "a"), (0.0, "a")], [None, None]),
        ({"max_bytes": 2}, [(0.0, "ab"), (0.0, "abc")], [None, "tx_size_cap"]),
        ({"decimate": 1}, [(0.0, "a"), (0.0, "b")], [None, None]),
        (
            {"decimate": 2}, [(0.0, "a"), (0.0, "b"), (0.0, "c"), (0.0, "d")],
            [None, "tx_decimated", None, "tx_decimated"],
        ),
        (
            {"on_change": True}, [(0.0, "a"), (0.0, "a"), (0.0, "b"), (0.0, "a")],
            [None, "tx_unchanged", None, None],
        ),
        (
            {"period_s": 1.0},
            [(t, "a") for t in (0.0, 0.99, 1.25, 1.99, 2.0, 2.99, 4.0, 4.99, 5.5, 5.99, 6.0)],
            [None, "tx_throttled"] * 2 + [None, "tx_throttled"] * 3 + [None],
        ),
        (
            {"period_s": 1.0, "on_change": True},
            [(0.0, "a"), (0.5, "b"), (1.0, "b"), (1.5, "b"), (2.0, "b"), (2.5, "a"), (3.0, "a")],
            [None, "tx_throttled", None, "tx_unchanged", "tx_unchanged", None, "tx_unchanged"],
        ),
        (
            {"period_s": 1.0, "decimate": 2, "max_bytes": 2},
            [(0.0, "abc"), (0.0, "a"), (0.5, "a"), (0.5, "a"), (1.5, "a"), (1.5, "a")],
            ["tx_size_cap", None, "tx_decimated", "tx_throttled", "tx_decimated", None],
        ),
    ],
)  # fmt: skip
def test_what_a_policy_admits(policy, given_to, refused):
    admission = Admission(TopicPolicy(**policy))
    told = [admission.refuse(text.encode(), at, is_for_all=True) for at, text in given_to]
    if "on_change" in policy and "period_s" in policy:
        # 2.5 s is before the next time of the grid, 3 s is not.
        refused = [*refused[:5], None, "tx_unchanged"]
    assert told == refused


def test_a_frame_of_zstd_is_used_if_it_is_smaller():
    plain, trained = Deflated(None), Deflated(dictionary())
    assert plain.shrink(b"a" * 63) is None
    assert 0 < len(plain.shrink(b"a" * 64)) < 64
    assert plain.shrink(bytes(range(256))) is None
    assert trained.shrink(SAMPLES[0][:40]) is not None
    assert trained.shrink(b"") is None
    assert (most_expanded(0), most_expanded(1024), most_expanded(1025)) == (
        65_536, 65_536, 65_600,
    )  # fmt: skip
    with pytest.raises(ValueError, match=r"\w"):
        train_dictionary([b"a"], 1000)


SAMPLES = [b"position %d of the robot %d in the map, velocity %d" % (i, i * 7, i % 5) * 3
           for i in range(300)]  # fmt: skip


def dictionary():
    import zstandard

    return zstandard.ZstdCompressionDict(train_dictionary(SAMPLES, 2000))


@pytest.mark.parametrize(("size", "n"), [(1, 1), (99, 1), (100, 1), (101, 2), (250, 3)])
def test_a_large_message_is_divided_from_its_beginning_on(size, n):
    parting, payload = Parting(100, 3, 77, True), bytes(i % 251 for i in range(size))
    assert parting.count_of(payload) == n
    for at in range(n):
        data = payload[100 * at : 100 * at + 100]
        assert parting.part(payload, n - at) == build_part(Part(3, 77, at, n, data))


def test_a_large_message_goes_part_by_part_and_its_age_with_the_last():
    made = Outgoing(
        3, bytes(250), Qos.DEFAULT, 64, 255, 0.0, inf, True, TxTally(),
        parting=Parting(100, 3, 77, True),
    )  # fmt: skip
    assert (made.channel, made.parts_left, made.stamped, made.overhead) == (PARTS, 2, True, 1)
    for left in (2, 1, 0):
        assert made.body == Parting(100, 3, 77, True).part(bytes(250), left + 1)
        assert made.needs_id == (left < 2)
        made.cut(10 + left, 60, 2, 1.0)
        assert (made.stamped, made.rests_id, made.needs_id) == (left > 0, True, False)
        assert made.next_size == len(made.body)
        made.advance(1, 2.0)
        assert (made.next_size, made.is_through) == (max(0, len(made.body) - 60), False)
        made.advance(1, 3.0)
        assert (made.next_size, made.is_through) == (0, left == 0)
        assert (made.last_at, made.unconfirmed) == (3.0, 2 * (3 - left))
        assert made.go_on() == (left > 0)
        assert made.parts_left == max(0, left - 1)
    assert made.ids == (12, 11, 10)
    made.follow_with([b"y", b"x"])
    assert not made.is_through
    assert made.in_vain(inf, 0.0) == "", "a receiver may need just that"
    assert (made.give_parity(), made.give_parity()) == (b"x", b"y")
    assert made.is_through


def test_a_message_is_worth_sending_until_it_expires_or_its_receivers_give_up():
    made = outgoing(until=5.0)
    assert made.stamped, "no age is wanted"
    assert (made.in_vain(4.9, 1.0), made.in_vain(5.0, 1.0)) == ("", "tx_expired")
    assert not made.is_through
    made.cut(1, 5, 2, 1.0)
    assert (made.in_vain(2.0, 1.0), made.in_vain(2.1, 1.0)) == ("", "tx_stalled")
    whole = outgoing()
    whole.cut(1, 10, 1, 0.0)
    assert not whole.rests_id
    whole.keep_id()
    assert whole.rests_id
    assert (outgoing(number=20).channel, outgoing(number=20).overhead) == (20, 1)


class Model:
    """The messages in the queue, in the plainest form."""

    def __init__(self, outbox):
        self.outbox, self.waiting, self.begun = outbox, [], []

    def check(self):
        outbox, waiting, begun = self.outbox, self.waiting, self.begun
        both = [*begun, *waiting]
        assert outbox.queued == len(waiting)
        assert outbox.queued_bytes == sum(len(each.payload) for each in waiting)
        assert outbox.queued_by_class() == {
            qos: sum(each.qos is qos for each in waiting) for qos in Qos
        }
        for topic_id in range(3):
            assert outbox.queued_of_topic(topic_id) == sum(
                each.topic_id == topic_id for each in waiting
            )
        assert outbox.waiting_bytes() == {
            qos: sum(WITH_AGE + left(each) for each in both if each.qos is qos) for qos in Qos
        }
        assert outbox.destinations() == {each.dst for each in both}
        assert outbox.waiting_classes() == {each.qos for each in both}
        assert outbox.has_lifespans() == any(each.expires_at < inf for each in both)
        assert outbox.first_begun() == min((each.last_at for each in begun), default=inf)
        total = sum(ENTRY + left(each) for each in both) - ENTRY
        assert outbox.pending_bytes(1 << 30) == total
        assert min(total, 20) <= outbox.pending_bytes(20) <= max(20, total)
        heads = {}
        for each in both:
            heads.setdefault((each.qos, -each.priority, each.topic_id, each.dst), each)
        first = min(((each.qos, -each.priority) for each in both), default=None)
        assert outbox.oldest_arrival() == min((e.arrived_at for e in heads.values()), default=inf)
        assert bool(outbox) == bool(both)
        assert outbox.next_class() == (first and first[0])
        head = outbox.next_message
        if head is None:
            assert not both
            return None
        assert (head.qos, -head.priority) == first
        assert head in heads.values()
        equals = [each for each in heads.values() if (each.qos, -each.priority) == first]
        spent = [each.lane.account.spent for each in equals]
        assert head.lane.account.spent == min(spent)
        keys = [level.key for level in outbox.levels]
        assert keys == sorted({(each.qos, -each.priority) for each in both})
        return head


def left(message):
    return len(message.body) - message.next_index * message.k


def unlike(draw_at):
    return st.tuples(
        st.just("put"), st.integers(0, 40), st.sampled_from(Qos), st.sampled_from([1, 64]),
        st.integers(0, 2), st.sampled_from([2, 255]), draw_at, st.sampled_from([5.0, 7.0, inf]),
    )  # fmt: skip


steps = st.lists(
    unlike(st.integers(0, 9))
    | unlike(st.integers(0, 9))
    | st.just(("serve",))
    | st.just(("drop",)),
    max_size=40,
)


@law(120)
@given(steps)
def test_the_queue_is_as_its_plainest_form(steps):
    outbox = Outbox(PLENTY, 64)
    model = Model(outbox)
    for now, step in enumerate(steps):
        head = model.check()
        if step[0] == "put":
            made = outgoing(*step[1:])
            assert outbox.put(made, DEFAULT_POLICY, inf) is None
            model.waiting.append(made)
        elif head is None:
            continue
        elif step[0] == "drop":
            assert outbox.withdraw_head(head.lane) is head
            (model.begun if head in model.begun else model.waiting).remove(head)
        elif head in model.begun:
            head.advance(1, now)
            if head.next_index == head.total:
                outbox.end(head.lane)
                model.begun.remove(head)
            outbox.served(head.lane, 15)
        else:
            outbox.begin(head.lane, 1, 15, max(1, -(-len(head.payload) // 15)), now)
            model.waiting.remove(head)
            model.begun.append(head)
            assert head.lane.current is head
    model.check()
    outbox.drop_all("tx_shutdown")
    assert (outbox.queued, outbox.in_flight, bool(outbox)) == (0, 0, False)
    assert outbox.queued_bytes == 0


def test_equal_lanes_take_turns_and_the_earliest_expiry_comes_first():
    outbox = Outbox(PLENTY, 64)
    for topic_id, until in ((0, inf), (1, inf), (2, inf), (0, inf), (1, inf), (2, 5.0), (3, 4.0)):
        outbox.put(outgoing(topic_id=topic_id, until=until), DEFAULT_POLICY, inf)
    served = []
    while (head := outbox.next_message) is not None:
        served.append(head.topic_id)
        outbox.withdraw_head(head.lane)
    assert served == [3, 0, 1, 2, 2, 0, 1]
    levels = []
    for qos in (Qos.URGENT, Qos.DEFAULT, Qos.BULK):
        for priority in (1, 2):
            outbox.put(outgoing(qos=qos, priority=priority), DEFAULT_POLICY, inf)
    levels = [level.key for level in with_first(outbox.levels, Qos.DEFAULT)]
    assert levels == [(2, -2), (2, -1), (0, -2), (0, -1), (3, -2), (3, -1)]


def relayed(src=9, qos=Qos.DEFAULT):
    payload = build(Pdu(0, False, src, 255, 0, 2, [Entry(0, 1, 0, 1, b"x")]), 32)
    return Outgoing(
        512 + src, payload, qos, 64, 255, 0.0, inf, False, TxTally(), is_whole=True
    )  # fmt: skip


def test_the_source_of_the_next_pdu_is_that_of_the_next_message():
    outbox = Outbox(PLENTY, 64)
    assert outbox.next_relayed() is None
    outbox.put(outgoing(qos=Qos.BULK), DEFAULT_POLICY, inf)
    assert not outbox.relays
    outbox.put(relayed(9), DEFAULT_POLICY, inf)
    outbox.put(relayed(8, Qos.URGENT), DEFAULT_POLICY, inf)
    assert outbox.relays
    told = [outbox.next_relayed(qos) for qos in (None, *Qos)]
    assert told == [8, 8, None, 9, None]
    outbox.drop_all("tx_shutdown")
    assert outbox.next_relayed() is None


def put_all(limits, policy, *messages, bytes_per_s=inf):
    """What becomes of messages that are put one after the other, by reason."""
    outbox = Outbox(QueueParams(**{"max_messages": 100, "max_bytes": 10_000, **limits}), 64)
    told = [outbox.put(each, policy, bytes_per_s) for each in messages]
    dropped = {i: reason for i, each in enumerate(messages) for reason in each.tally.dropped}
    assert [told[i] for i in range(len(told))] == [
        reason if reason == "tx_overflow_new" else None
        for reason in (dropped.get(i) for i in range(len(told)))
    ]
    return dropped


@pytest.mark.parametrize(
    ("limits", "policy", "bytes_per_s", "sizes", "dropped"),
    [
        ({"max_messages": 2}, {}, inf, [1, 1], {}),
        ({"max_bytes": 20}, {}, inf, [20], {}),
        ({"max_bytes": 20}, {}, inf, [5, 20], {0: "tx_overflow_old"}),
        ({"max_messages": 2}, {}, inf, [1, 1, 1], {0: "tx_overflow_old"}),
        ({"max_bytes": 20}, {}, inf, [10, 10], {}),
        ({"max_bytes": 20}, {}, inf, [10, 10, 1], {0: "tx_overflow_old"}),
        ({"max_bytes": 20}, {}, inf, [10, 21], {1: "tx_overflow_new"}),
        ({"max_airtime_s": 2.0}, {}, 10, [10, 10], {}),
        ({"max_airtime_s": 2.0}, {}, 10, [10, 10, 1], {0: "tx_overflow_old"}),
        ({"max_airtime_s": 2.0}, {}, 10, [21], {0: "tx_overflow_new"}),
        ({}, {"depth": 2}, inf, [1, 2, 3], {0: "tx_superseded"}),
        ({}, {"depth": 2, "history": "keep_all"}, inf, [1, 2, 3], {}),
        ({}, {"queue_bytes": 20}, inf, [10, 10], {}),
        ({}, {"queue_bytes": 20}, inf, [5, 10, 10], {0: "tx_topic_full"}),
        ({}, {"queue_bytes": 20}, inf, [5, 30], {0: "tx_topic_full"}),
        ({}, {"queue_s": 2.0}, 10, [5, 15], {}),
        ({}, {"queue_s": 2.0}, 10, [5, 5, 15], {0: "tx_topic_full"}),
        ({}, {"queue_s": 2.0, "queue_bytes": 10}, 10, [5, 10], {0: "tx_topic_full"}),
    ],
)
def test_limits_are_kept_by_dropping_the_oldest(limits, policy, bytes_per_s, sizes, dropped):
    messages = [outgoing(size) for size in sizes]
    assert put_all(limits, TopicPolicy(**policy), *messages, bytes_per_s=bytes_per_s) == dropped


def test_room_is_made_among_lower_classes_only():
    urgent, bulk = {"qos": Qos.URGENT}, {"qos": Qos.BULK}
    two = {"max_messages": 2}
    assert put_all(two, DEFAULT_POLICY, outgoing(), outgoing(**bulk), outgoing(**urgent)) == {
        1: "tx_overflow_old"
    }
    assert put_all(two, DEFAULT_POLICY, outgoing(), outgoing(**urgent), outgoing(**bulk)) == {
        2: "tx_overflow_new"
    }
    few = {"max_bytes": 30}
    messages = [outgoing(10, **urgent), outgoing(10), outgoing(21), outgoing(20)]
    assert put_all(few, DEFAULT_POLICY, *messages) == {
        1: "tx_overflow_old", 2: "tx_overflow_new",
    }  # fmt: skip
    assert put_all(two, DEFAULT_POLICY, outgoing(**urgent), outgoing(**urgent), outgoing()) == {
        2: "tx_overflow_new"
    }


def test_depth_and_limits_hold_for_each_key_and_topic():
    keyed = [outgoing(topic_id=topic, key=key) for topic, key in
             ((0, "a"), (0, "b"), (1, "a"), (0, "a"), (0, "b"))]  # fmt: skip
    assert put_all({}, TopicPolicy(depth=1), *keyed) == {0: "tx_superseded", 1: "tx_superseded"}
    apart = [outgoing(10, topic_id=topic, dst=dst) for topic, dst in ((0, 1), (1, 1), (0, 2))]
    assert put_all({}, TopicPolicy(queue_bytes=15), *apart) == {0: "tx_topic_full"}


def test_a_message_counts_as_sent_when_all_its_pdus_have_left():
    outbox = Outbox(PLENTY, 64)
    lives, made = outbox.lives, outgoing(20, receipt="a.1")
    outbox.put(made, DEFAULT_POLICY, inf)
    outbox.begin(made.lane, 1, 10, 2, 0.0)
    assert (outbox.in_flight, made.fate) == (1, Fate.IN_FLIGHT)
    made.advance(1, 0.0)
    lives.left([[made]])
    assert made.fate is Fate.IN_FLIGHT
    made.advance(1, 0.0)
    made.ride()
    lives.left([[made]])
    assert (made.fate, made.unconfirmed) == (Fate.IN_FLIGHT, 1)
    lives.left([[], [made]])
    assert (made.fate, made.tally.sent, made.tally.sent_bytes) == (Fate.SENT, 1, 20)
    assert outbox.in_flight == 0
    lives.left([[made]])
    assert made.tally.sent == 1
    assert lives.take_dropped_asking() == []


def test_a_burst_that_failed_drops_what_it_carried_and_tells_what_has_more_to_send():
    outbox = Outbox(PLENTY, 64)
    done, more = (outgoing(20, topic_id=i, receipt="r" * i) for i in range(2))
    for made in (done, more):
        outbox.put(made, DEFAULT_POLICY, inf)
        outbox.begin(made.lane, 1, 10, 2, 0.0)
        made.advance(2, 0.0)
    outbox.end(done.lane)
    assert outbox.lives.failed([[done, more], [done]], "tx_radio_failed") == [more]
    assert (done.unconfirmed, more.unconfirmed) == (0, 1)
    assert [each.tally.dropped for each in (done, more)] == [{"tx_radio_failed": 1}] * 2
    assert outbox.in_flight == 0
    assert outbox.lives.take_dropped_asking() == [(more, "tx_radio_failed")]
    assert outbox.lives.take_dropped_asking() == []


def test_a_ledger_that_does_not_add_up_says_so():
    assert balance("x", 3, {"a": 1, "b": 2}) == []
    assert balance("x", 0, {}) == []
    assert balance("x", 3, {"a": 1, "b": 1}) == ["x: 3 entered, but 1 a + 1 b = 2"]
    assert balance("x", 1, {"a": 2, "b": -1}) == ["x: 1 entered, but 2 a + -1 b = 1"]
    tally = TxTally()
    tally.accept(5)
    tally.accept_again()
    tally.send(7)
    tally.drop("tx_expired")
    assert tally == TxTally(2, 5, 1, 7, 1, Counter({"tx_expired": 1}))


def latched(*kept, most=1 << 20):
    made = Latched(most)
    for text, dst in kept:
        made.keep(0, Kept(text.encode(), 0.0, Overrides(dst=dst)), 9)
    return made


def offers(made, now, bytes_per_s=1e9):
    return [(each.kept.payload.decode(), each.dst) for each in made.due(now, bytes_per_s)]


def test_who_is_new_gets_what_is_for_it_or_for_all():
    made = latched(("all", None), ("all255", 255), ("two", 2), ("three", 3))
    assert offers(made, 0.0) == []
    made.newcomer(2, 1.0)
    assert offers(made, 1.19) == [], "others may follow"
    assert offers(made, 1.25) == [("all", 2), ("all255", 255), ("two", 2)]
    assert offers(made, 2.0) == []
    made.newcomer(2, 3.0)
    made.newcomer(3, 3.1)
    assert offers(made, 3.25) == [], "others may follow"
    assert offers(made, 3.35) == [("all", 255), ("all255", 255), ("two", 2), ("three", 3)]
    made.newcomer(7, 4.0)
    made.forget(0)
    made.forget(5)
    assert offers(made, 5.0) == []


def test_what_is_offered_again_takes_two_per_cent_of_the_air():
    made = latched(*((str(i) * 100, None) for i in range(5)))
    made.newcomer(2, 0.0)
    told = []
    for step in range(1, 2000):
        told += [step / 4] * len(offers(made, step / 4, 100.0))
    # Each takes a second, which is earned in 50 s; the first one is sent on credit.
    assert told == [0.25, 50.25, 100.25, 150.25, 200.25]
    made.newcomer(3, 1000.0)
    assert len(offers(made, 2000.0, 100.0)) == 2, "no more than a second is saved up"


@pytest.mark.parametrize("most", [1 << 20, 250])
def test_what_is_latched_has_a_bound_also_after_a_topic_is_forgotten(most):
    made = Latched(most)
    for topic_id, key in ((0, "a"), (0, "b"), (1, "a"), (0, "a"), (0, "c")):
        made.keep(topic_id, Kept(key.encode() * 100, 0.0, Overrides(key=key)), 1)
    made.forget(1)
    made.keep(0, Kept(b"d" * 100, 0.0, Overrides(key="d")), 1)
    made.newcomer(2, 0.0)
    assert offers(made, 0.0) == []
    found = "".join(text[0] for text, _ in offers(made, 1.0))
    assert found == ("bacd" if most > 250 else "cd")


REGISTRY = make_registry([("odom", "nav_msgs/Odometry"), ("scan", "sensor_msgs/LaserScan")])


def intake(has_numbers=True, classes=None, outbox=None, **more):
    if outbox is None:
        outbox = Outbox(PLENTY, 64)
    topics = OwnTopics(REGISTRY, has_numbers, 100)
    params = LinkParams(pdu_size=64)
    return Intake(params, topics, outbox, classes or ClassesParams(), {}, 65_535, **more)


def next_of(made, outbox, *args, **more):
    assert made.submit(*args, **more) is None
    head = outbox.next_message
    outbox.withdraw_head(head.lane)
    return head


def test_a_message_is_treated_as_its_producer_wishes_and_else_as_its_topic():
    outbox = Outbox(PLENTY, 64)
    made = intake(outbox=outbox)
    made.set_policy(0, TopicPolicy(qos="urgent", priority=9, dst=3, lifespan_s=4.0, stamp=False))
    head = next_of(made, outbox, 0, b"data", 1.0)
    assert (head.qos, head.priority, head.dst) == (Qos.URGENT, 9, 3)
    assert (head.arrived_at, head.expires_at, head.stamped) == (1.0, 5.0, True)
    wishes = Overrides(Qos.BULK, 0, 0, 2.0, 0.5, "a.1", "key")
    head = next_of(made, outbox, 0, b"data", 1.0, wishes)
    assert (head.qos, head.priority, head.dst) == (Qos.BULK, 0, 0)
    assert (head.arrived_at, head.expires_at, head.stamped) == (0.5, 2.5, False)
    assert (head.receipt, head.key) == ("a.1", "key")
    assert made.treatment(0) == (Qos.URGENT, 9)
    assert (made.destination(0), made.destination(1)) == (3, 255)
    assert made.lifespan(0) == (4.0, "topic")
    assert made.lifespan(1, Qos.URGENT) == (1.0, "class")
    assert made.lifespan(1) == (inf, "")


def test_a_message_whose_lifespan_is_over_is_not_queued():
    made = intake()
    for age_s, refused in ((1.5, "tx_expired"), (1.25, None)):
        wishes = Overrides(age_s=age_s, lifespan_s=1.5)
        assert made.submit(0, b"data", 8.0, wishes) == refused
    assert made.tally(0).dropped == {"tx_expired": 1}


@pytest.mark.parametrize(
    ("age_s", "lifespan_s", "arrived_at"),
    [(10.0, None, 90.0), (10.1, None, 100.0), (10.1, 60.0, 89.9), (10.1, inf, 100.0)],
)
def test_an_age_that_is_unlikely_counts_from_now(age_s, lifespan_s, arrived_at):
    outbox = Outbox(PLENTY, 64)
    wishes = Overrides(age_s=age_s, lifespan_s=lifespan_s)
    head = next_of(intake(outbox=outbox), outbox, 0, b"data", 100.0, wishes)
    assert head.arrived_at == arrived_at


def test_large_messages_are_parted_evenly_with_the_parity_of_their_class():
    for share, has_numbers in ((0.0, True), (0.5, True), (0.0, False)):
        outbox = Outbox(PLENTY, 64)
        made = intake(has_numbers, ClassesParams(default=DefaultParams(parity=share)), outbox)
        most = 255 * 51
        assert next_of(made, outbox, 0, bytes(most), 0.0).channel == 0
        if not has_numbers:
            assert made.submit(0, bytes(most + 1), 0.0) == "tx_too_big"
            continue
        each = part_size(64, share)
        for serial, size in enumerate((most + 1, each * 3, each * 3 + 1)):
            head = next_of(made, outbox, 0, bytes(size), 0.0)
            n = -(-size // each)
            even = -(-size // n)
            assert (head.channel, head.parts_left) == (PARTS, n - 1)
            assert head.body == build_part(Part(0, serial, 0, n, bytes(even)))
        largest = max_large_size(64, share)
        assert made.submit(0, bytes(largest + 1), 0.0) == "tx_too_big"
        assert made.submit(0, bytes(largest), 0.0) is None
        assert made.tally(0).dropped == {"tx_too_big": 1}


@pytest.mark.parametrize(
    ("size", "max_bytes", "is_sealed", "is_compressed"),
    [
        (65_536, 0, False, True), (65_537, 0, False, False), (65_537, 0, True, True),
        (65_537, 70_000, False, True),
    ],
)  # fmt: skip
def test_what_receivers_would_not_expand_is_sent_as_it_is(
    size, max_bytes, is_sealed, is_compressed
):
    outbox = Outbox(PLENTY, 64)
    made = intake(outbox=outbox, is_sealed=is_sealed)
    made.set_policy(0, TopicPolicy(compress="zstd", max_bytes=max_bytes))
    head = next_of(made, outbox, 0, bytes(size), 0.0)
    assert head.is_compressed == is_compressed
    assert (len(head.payload) < 1000) == is_compressed


def test_latched_messages_are_queued_again_while_they_live():
    outbox = Outbox(PLENTY, 64)
    made = intake(outbox=outbox)
    kept = Kept(b"data", 1.0, Overrides(lifespan_s=5.0, dst=7))
    made.offer_again(Offer(0, kept, 9), 6.0, inf)
    assert outbox.queued == 0
    made.offer_again(Offer(0, kept, 9), 5.9, inf)
    head = outbox.next_message
    assert (head.dst, head.arrived_at, head.expires_at) == (9, 1.0, 6.0)
    tally = made.tally(0)
    assert (tally.accepted, tally.reoffered, tally.accepted_bytes) == (1, 1, 0)
    made.set_policy(1, TopicPolicy(lifespan_s=2.0))
    made.offer_again(Offer(1, kept._replace(overrides=Overrides()), 9), 3.0, inf)
    assert made.tally(1).accepted == 0


def test_relayed_pdus_have_the_priority_of_their_most_urgent_topic_and_a_lane_of_their_source():
    outbox = Outbox(PLENTY, 64)
    made = intake(outbox=outbox)
    made.set_policy(1, TopicPolicy(priority=99))
    for topics, priority in (
        ((0,), 64), ((0, 1), 99), ((7,), 0), ((16,), 64), ((255,), 64), ((PARTS,), 64), ((15,), 0),
        ((), 0),
    ):  # fmt: skip
        pdu = Pdu(3, False, 9, 4, 0, 2, [Entry(each, 0, 0, 1, b"") for each in topics])
        assert made.forward(pdu, b"octets", 1.0, 2.0, 77, inf, is_bare=True) is None
        head = outbox.next_message
        outbox.withdraw_head(head.lane)
        assert (head.priority, head.qos, head.dst) == (priority, Qos.URGENT, 4)
        assert (head.is_whole, head.is_bare, head.pdu_number, head.expires_at) == (
            True, True, 77, 2.0,
        )  # fmt: skip
    assert made.report_relayed().accepted == 8


def test_what_was_taken_and_refused_is_counted_and_reported():
    outbox = Outbox(PLENTY, 64)
    made = intake(outbox=outbox)
    made.set_policy(0, TopicPolicy(max_bytes=10, lifespan_s=9.0))
    assert made.submit(0, bytes(11), 0.0) == "tx_size_cap"
    assert made.submit(0, bytes(3), 0.0) is None
    assert made.submit(0, bytes(3), 0.0, is_admitted=False) == "tx_not_admitted"
    made.refuse("tx_bad_envelope")
    made.refuse("tx_denied", 1)
    assert made.totals() == (
        5, 0, {"tx_size_cap": 1, "tx_not_admitted": 1, "tx_bad_envelope": 1, "tx_denied": 1},
    )  # fmt: skip
    assert made.counters() == {
        ("tx", 0): 3, ("accepted_bytes", 0): 17, ("tx", 1): 1, ("accepted_bytes", 1): 0,
    }  # fmt: skip
    report = made.report(REGISTRY.topics[0])
    assert (report.name, report.queued, report.accepted) == ("/odom", 1, 3)
    assert (report.lifespan_s, report.lifespan_from) == (9.0, "topic")
    assert made.report(REGISTRY.topics[1]).lifespan_s is None
    assert made.audit() == []
    outbox.withdraw_head(outbox.next_message.lane)
    (problem,) = made.audit()
    assert problem.startswith("tx messages: 5 entered, but 0 sent + 0 queued + 0 in_flight + ")
    assert problem.endswith(" = 4")
    made.set_policy(0, TopicPolicy(period_s=5.0))
    assert made.submit(0, b"1234", 1.0) is None
    made.set_policy(0, TopicPolicy(period_s=5.0))
    assert made.submit(0, b"1234", 1.0) == "tx_throttled", "the same policy changes nothing"
    made.begin_anew()
    assert made.submit(0, b"1234", 0.0) is None
    made.add(0)
    assert made.tally(0).accepted == 6, "it is there already"


def test_steps_that_cannot_be_are_counted(monkeypatch):
    monkeypatch.setattr(Lives, "is_strict", False)
    lives, made = Lives(), outgoing(receipt="a.1")
    assert made.step(Step.DROP)
    lives.begin(made)
    lives.drop(made, "tx_expired")
    assert (lives.illegal_steps, lives.in_flight, made.tally.dropped) == (2, set(), {})
    assert lives.take_dropped_asking() == []
