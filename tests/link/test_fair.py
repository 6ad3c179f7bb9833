"""Topics of one class and priority share the air, and one below its share waits for little."""

import struct
from collections import Counter
from math import inf
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import (
    HEAD_START,
    ClassesParams,
    LinkParams,
    Offer,
    Opportunity,
    Outcome,
    Overrides,
    Qos,
    QueueParams,
    TopicPolicy,
)
from sdrlinkd.link.queue import Intake, Outbox
from sdrlinkd.link.topics import OwnTopics
from sdrlinkd.wire import (
    ENTRY_HEADER_SIZE,
    Entry,
    Pdu,
    Registry,
    build,
    equal_payload,
    numbered,
    parse,
)
from tests.laws import law
from tests.link.world import make_link, outgoing

PDU_SIZE = 220
PDU_S = 0.001
BURST = 8
ROOM = equal_payload(PDU_SIZE, 1)
AHEAD = HEAD_START + 2
ENTRY = ENTRY_HEADER_SIZE + 1


class Air:
    """Sends what one link has, in bursts of at most BURST PDUs, in virtual time."""

    def __init__(self, n_topics, weights=(), seed=1, **params):
        self.link = make_link(topics=None, has_numbers=True, pdu_size=PDU_SIZE, seed=seed, **params)
        self.topics = []
        for i in range(n_topics):
            offer = Offer(f"t{i}", "std_msgs/msg/String")
            self.topics.append(self.link.declare(offer).id)
        for topic, weight in zip(self.topics, weights, strict=False):
            self.link.set_policy(topic, TopicPolicy(weight=weight))
        self.now = 0.0
        self.sent = Counter()
        """Octets by topic, with those of headers, and of what PDUs leave unused."""
        self.turns = Counter()
        """Of these, those of the first topic of each PDU; others fill the room that it leaves."""
        self.done_at = {}
        """When the last fragment of a message had left, by the number that it begins with."""

    def submit(self, i, number, size, at, **wishes):
        payload = struct.pack("<I", number) + bytes(max(0, size - 4))
        return self.link.submit(self.topics[i], payload, at, Overrides(**wishes))

    def step(self):
        """Send one burst; False if there is nothing to send."""
        link = self.link
        burst = link.next_burst(
            Opportunity(
                self.now, lambda _, n: n * PDU_S, lambda _, s: int(min(BURST, s / PDU_S + 1e-6))
            )
        )
        if burst is None:
            return False
        self.now = max(self.now, burst.start)
        for data, carried in zip(burst.pdus, burst.carried, strict=True):
            self.now += PDU_S
            for message in carried:
                self.done_at[struct.unpack_from("<I", message.payload)[0]] = self.now
            entries = numbered(parse(data, PDU_SIZE)).entries
            own = [(each.topic_id, len(each.payload) + ENTRY) for each in entries]
            own = [each for each in own if each[0] in self.topics]
            unused = (ROOM - sum(n for _, n in own)) / max(1, len(carried))
            for topic, n in own:
                self.sent[self.topics.index(topic)] += n
            for message in carried:
                self.sent[self.topics.index(message.topic_id)] += max(0, unused)
            if own:
                self.turns[self.topics.index(own[0][0])] += own[0][1]
        link.confirm(burst, Outcome.SENT, self.now)
        return True


def any_weights(n, rng):
    return [rng.choice((0.5, 1.0, 1.0, 4.0)) for _ in range(n)]


@pytest.mark.slow
@law(60)
@given(n=st.integers(2, 16), seed=st.integers(0, 2**32))
def test_topics_that_always_have_something_get_air_by_their_weights(n, seed):
    rng = Random(seed)
    weights = any_weights(n, rng)
    sizes = [rng.choice((20, 150, 400, 3000)) for _ in range(n)]
    air = Air(n, weights, seed)
    queued, number = Counter(), 0
    while air.now < 0.04 * n:
        for i in range(n):
            # Twice what could be sent in a burst.
            while queued[i] < air.sent[i] + 2 * BURST * ROOM:
                air.submit(i, number, sizes[i], air.now)
                queued[i] += sizes[i]
                number += 1
        assert air.step()
    for i in range(n):
        for j in range(n):
            # What others could not use may be more than a topic's share.
            off = air.turns[i] / weights[i] - air.sent[j] / weights[j]
            ahead = AHEAD * PDU_SIZE * (1 / weights[i] + 1 / weights[j])
            assert off <= ahead


@pytest.mark.parametrize("seconds", [0.1, 3.0])
def test_room_that_others_leave_runs_up_no_debt(seconds):
    """A topic of little weight that lives on it has its share as soon as others take the room."""
    air = Air(3)
    weights, sizes = (1.0, 4.0, 4.0), (150, 400, 400)
    for topic, weight in zip(air.topics, weights, strict=True):
        air.link.set_policy(topic, TopicPolicy(depth=40, weight=weight))

    def run(until, n):
        while air.now < until:
            for i in range(n):
                for _ in range(2 * BURST):
                    air.submit(i, 0, sizes[i], air.now)
            air.step()

    run(seconds, 2)
    assert air.sent[0] > 1.5 * air.sent[1] / 4, "the control: it has more than its share"
    before = air.sent.copy()
    run(seconds + 0.6, 3)
    sent = air.sent - before
    assert sent[0] > 0.9 * sent.total() / sum(weights)


@pytest.mark.slow
@law(100)
@given(n=st.integers(2, 64), seed=st.integers(0, 2**32))
def test_a_topic_below_its_share_waits_for_no_more_than_its_bound(n, seed):
    rng = Random(seed)
    weights = any_weights(n, rng)
    air = Air(n, weights, seed)
    share = weights[0] / sum(weights)
    size = rng.choice((20, 150, 400, 1500))
    n_pdus = -(-(size + 20) // (ROOM - 20)) + 1
    period_s = n_pdus * PDU_S / share * rng.uniform(1.0, 3.0)
    bound_s = (BURST + n_pdus / share + AHEAD * (n - 1) + 1) * PDU_S
    others = [(i, rng.choice((20, 150, 400, 3000, 9000))) for i in range(1, n)]
    due = {i: rng.random() * period_s for i in range(n)}
    number, came_at, waited = 1, {}, []
    while len(came_at) < 5:
        for i, other in others:
            # Each offers more than its share, or now and then a whole heap.
            while due[i] <= air.now:
                for _ in range(rng.choice((1, 1, 1, 5))):
                    air.submit(i, 0, other, due[i])
                due[i] += other / ROOM * PDU_S * sum(weights) / weights[i] * rng.uniform(0.2, 1.2)
        while due[0] <= air.now:
            air.submit(0, number, size, due[0])
            came_at[number] = due[0]
            number += 1
            due[0] += period_s
        if not air.step():
            air.now = min(due.values())
    while len(air.done_at) <= len(came_at) and air.step():
        pass
    waited = [air.done_at[each] - at for each, at in came_at.items()]
    assert max(waited) <= bound_s


def test_one_that_was_away_goes_first_and_saves_up_no_more_than_its_head_start():
    air = Air(2)
    for _ in range(200):
        air.submit(0, 0, 150, 0.0)
    for _ in range(5):
        air.step()
    for _ in range(200):
        air.submit(1, 1, 150, air.now)
    before = air.sent[0]
    air.step()
    assert air.sent[1] >= HEAD_START * ROOM
    for _ in range(10):
        air.step()
    assert air.sent[1] - (air.sent[0] - before) <= AHEAD * PDU_SIZE


@pytest.mark.parametrize("qos", Qos)
def test_reliability_and_lifespans_do_not_change_the_order_of_topics(qos):
    air = Air(2)
    for _ in range(100):
        air.submit(0, 0, 150, 0.0, qos=qos, lifespan_s=0.5)
        air.submit(1, 1, 150, 0.0, qos=qos)
    for _ in range(4):
        air.step()
    assert air.sent[0] == pytest.approx(air.sent[1], abs=PDU_SIZE)


MOST_BYTES = 200_000


@pytest.mark.slow
@law(10)
@given(
    n=st.sampled_from([2, 5, 20, 239]),
    size=st.sampled_from([30, 1000, 20_000, 150_000]),
    jumps=st.booleans(),
    seed=st.integers(0, 2**32),
)
def test_a_producer_that_offers_a_hundred_times_the_air_harms_nobody_else(n, size, jumps, seed):
    """Its own messages fill the queue, and only they are dropped: all of them under a name."""
    rng = Random(seed)
    air = Air(n + 1, seed=seed, queue=QueueParams(max_bytes=MOST_BYTES, max_messages=300))
    sizes = [rng.choice((20, 150, 400)) for _ in range(n)]
    # Each of the others asks for its share at most, and they come in heaps.
    n_pdus = [1 + (each + 20) // (ROOM - 20) for each in sizes]
    period_s = 1.1 * (n + 1) * max(n_pdus) * PDU_S
    due = [rng.choice((0.0, 0.5, rng.random())) * period_s for _ in range(n)]
    sent, flood_at, lasts_s = 0, 0.0, 3 * period_s
    times, each = 100.0, size
    while air.now < lasts_s:
        for i in range(n):
            while due[i] <= air.now:
                assert air.submit(i, 1, sizes[i], due[i]) is None
                due[i] += period_s
                sent += 1
        while flood_at <= air.now:
            if jumps and rng.random() < 0.1:
                times, each = rng.choice((0.1, 1.0, 100.0)), rng.choice((30, 1000, 50_000))
            for _ in range(min(400, max(1, round(times * BURST * ROOM / each)))):
                air.submit(n, 0, each, air.now)
            flood_at = air.now + BURST * PDU_S
        if not air.step():
            air.now = min(*due, flood_at)
        tx = air.link.report(air.now).tx
        assert tx.queued_bytes <= MOST_BYTES
        assert tx.queued <= 300
    while air.step():
        pass
    reports = {each.topic_id: each for each in air.link.report(air.now).topics}
    others = [reports[topic] for topic in air.topics[:n]]
    assert [each.dropped for each in others] == [{}] * n
    assert sum(each.sent for each in others) == sent
    greedy = reports[air.topics[n]]
    assert greedy.accepted == greedy.sent + sum(greedy.dropped.values())
    assert set(greedy.dropped) <= {"tx_overflow_old", "tx_overflow_new"}
    assert air.link.audit() == []


def served(outbox, n):
    """The topics of the next messages that are sent whole, as of PDUs of 64 octets."""
    topics = []
    for _ in range(n):
        lane = outbox.next_message.lane
        topics.append(lane.topic_id)
        outbox.begin(lane, 1, 64, 1, 0.0)
        outbox.end(lane)
        outbox.served(lane, 64)
    return topics


def test_what_could_not_be_served_saves_up_no_more_than_twice_the_head_start():
    """Such as a topic without a free entry id."""
    outbox = Outbox(QueueParams(), 64)
    for topic_id in (0, 1):
        for _ in range(200):
            outbox.put(outgoing(topic_id=topic_id), TopicPolicy(), inf)
    blocked, other = outbox.levels[0].lanes
    for _ in range(100):
        outbox.begin(other, 1, 64, 1, 0.0)
        outbox.end(other)
        outbox.served(other, 64)
    first = served(outbox, 20)
    assert first.index(other.topic_id) <= 2 * HEAD_START + 1
    assert first.count(blocked.topic_id) <= 10 + HEAD_START + 1


def test_what_is_owed_is_paid_when_a_topic_is_served_next():
    """Repeats and what PDUs leave unused do not come from the queue."""
    outbox = Outbox(QueueParams(), 64)
    messages = [outgoing(topic_id=i % 2) for i in range(40)]
    for message in messages:
        outbox.put(message, TopicPolicy(), inf)
    messages[0].owe(5 * 64)
    assert served(outbox, 10).count(0) == pytest.approx(5 - 2.5, abs=1)


@pytest.mark.parametrize("others", [(9, 0), (9, 1), (8, 1)])
def test_relayed_pdus_are_charged_to_their_topic_at_their_source(others):
    outbox = Outbox(QueueParams(), 64)
    intake = Intake(LinkParams(pdu_size=64), OwnTopics(Registry(()), True, 100), outbox,
                    ClassesParams(), {})  # fmt: skip
    for src, topic_id in ((9, 0), others):
        pdu = Pdu(0, False, src, 255, 0, 2, [Entry(topic_id, 0, 0, 1, b"x")])
        for n in range(10 if topic_id else 30):
            assert intake.forward(pdu, build(pdu, 64), 0.0, inf, n, inf) is None
    n_topics = len({(9, 0), others})
    assert len({*served(outbox, 6)}) == n_topics
