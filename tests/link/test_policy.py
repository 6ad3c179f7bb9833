"""What a topic's policy accepts, keeps, shrinks and hands over."""

from itertools import pairwise
from random import Random

import msgspec
import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import (
    AccessParams,
    Outcome,
    Overrides,
    PduLinkTraits,
    Qos,
    QueueParams,
    RateParams,
    TopicPolicy,
)
from sdrlinkd.link.queue import Inflated
from sdrlinkd.wire import Entry, Pdu, build
from tests.laws import law
from tests.link.world import (
    classes_queued,
    compose,
    compose_at,
    make_link,
    neighbors,
    received,
    send_all,
    topic_of,
    tx,
)

CDR = b"\0\1\0\0"
TEXT = CDR + b"the same words over and over " * 40


def link_with(policy, **more):
    link = make_link(pdu_size=220, **more)
    link.set_policies({0: policy})
    return link


def reasons(link):
    return dict(topic_of(link, 0).dropped)


def test_a_throttled_topic_goes_at_its_period_on_average():
    """The producer's period of 20 ms does not divide the policy's."""
    link = link_with(TopicPolicy(period_s=0.05))
    taken = [i for i in range(500) if link.submit(0, TEXT, i * 0.02) is None]
    assert len(taken) == pytest.approx(10 / 0.05, abs=2)
    assert min(b - a for a, b in pairwise(taken)) >= 2
    assert reasons(link) == {"tx_throttled": 500 - len(taken)}


def test_a_pause_earns_no_credit():
    link = link_with(TopicPolicy(period_s=1.0))
    assert link.submit(0, TEXT, 0.0) is None
    assert [link.submit(0, TEXT, 100 + i / 10) for i in range(5)] == [None, *4 * ["tx_throttled"]]


def test_decimation_and_changes_and_size():
    link = link_with(TopicPolicy(decimate=3))
    assert [link.submit(0, TEXT, 0.0) is None for _ in range(6)] == [True, False, False] * 2
    link = link_with(TopicPolicy(on_change=True))
    told = [link.submit(0, CDR + word, 0.0) for word in (b"a", b"a", b"b", b"a")]
    assert told == [None, "tx_unchanged", None, None]
    link = link_with(TopicPolicy(max_bytes=100))
    assert link.submit(0, bytes(101), 0.0) == "tx_size_cap"
    assert link.submit(0, bytes(100), 0.0) is None
    assert link.audit() == []


def test_latest_wins_unless_all_are_to_be_kept():
    for history, kept in (("keep_last", 2), ("keep_all", 9)):
        link = link_with(TopicPolicy(depth=2, history=history))
        for i in range(9):
            link.submit(0, bytes([i]) * 30, 0.0)
        assert tx(link).queued == kept


def test_a_topics_own_bound_sheds_its_oldest_and_nobody_elses():
    link = link_with(TopicPolicy(queue_bytes=1000))
    link.submit(1, bytes(300), 0.0)
    for i in range(9):
        link.submit(0, bytes([i]) * 300, 0.0)
    assert reasons(link) == {"tx_topic_full": 6}
    assert tx(link).queued == 4
    assert link.submit(0, bytes(1001), 0.0) is None
    assert topic_of(link, 0).queued == 1


def test_bounds_in_seconds_follow_what_the_air_carries():
    link = link_with(TopicPolicy(queue_s=0.5), queue=QueueParams(max_airtime_s=2.0))
    compose_at(link, 1000)
    for _ in range(10):
        link.submit(0, bytes(200), 0.0)
        link.submit(1, bytes(200), 0.0)
    assert topic_of(link, 0).queued == 2
    assert tx(link).queued_bytes <= 2000
    assert link.audit() == []


@law(60)
@given(st.binary(max_size=3000), st.integers(0, 2**32), st.booleans())
def test_compressed_or_not_messages_arrive_as_they_were(payload, seed, repetitive):
    rng = Random(seed)
    message = CDR + (payload * 5 if repetitive else rng.randbytes(300))
    policies = {i: TopicPolicy(compress=rng.choice(("none", "zstd"))) for i in range(3)}
    sender, receiver = (make_link(i, pdu_size=220, seed=i) for i in (1, 2))
    for link in (sender, receiver):
        link.set_policies(policies)
    for topic in range(3):
        sender.submit(topic, message, 0.0)
    got = [m for pdu in send_all(sender) for m in receiver.hear(pdu, 0.0)]
    assert [m.payload for m in got] == 3 * [message]
    assert receiver.audit() == sender.audit() == []


def test_compression_saves_air_where_it_can():
    counts = []
    for compress in ("none", "zstd"):
        link = link_with(TopicPolicy(compress=compress))
        link.submit(0, TEXT, 0.0)
        counts.append(len(send_all(link)))
    assert counts[1] < counts[0] / 3


def test_a_dictionary_shrinks_small_messages_and_is_part_of_the_digest():
    rng, words = Random(1), b"frame base_link speed %d mode cruise"
    samples = [CDR + words % rng.randrange(99) for _ in range(500)]
    made = zstandard.train_dictionary(1000, samples)
    one = make_link(1, pdu_size=220, dictionaries={0: made}, beacon_s=1.0)
    two = make_link(2, pdu_size=220, dictionaries={0: made})
    three = make_link(3, pdu_size=220)
    counts = []
    for compress in ("none", "zstd"):
        one.set_policies({0: TopicPolicy(compress=compress)})
        for sample in samples[:20]:
            one.submit(0, sample, 0.0)
        pdus = send_all(one)
        counts.append(len(pdus))
    assert counts[1] < 0.8 * counts[0]
    two.hear(pdus[0], 0.0)
    pdus += send_all(one, 2.0)
    two = make_link(2, pdu_size=220, dictionaries={0: made})
    assert [m.payload for pdu in pdus for m in two.hear(pdu, 0.0)] == samples[:20]
    assert [m for pdu in pdus for m in three.hear(pdu, 0.0)] == []
    assert received(three)[1, 0].dropped["rx_no_dictionary"] == 20
    assert any("a different registry: topic id 0" in each for each in three.notices(0.0))
    assert neighbors(two)[1].registry == "same"


def compressed(payload, seq=0):
    return build(Pdu(0, True, 1, 255, seq, 1, [Entry(0, seq, 0, 1, payload)]), 220)


@pytest.mark.parametrize(
    ("frame", "reason"),
    [
        (b"no frame at all", "rx_bad_zstd"),
        (zstandard.compress(bytes(2_000_000)), "rx_inflates"),
        (zstandard.compress(TEXT)[:-3], "rx_bad_zstd"),
        (zstandard.compress(TEXT) + b"tail", "rx_bad_zstd"),
        (zstandard.compress(b"abc"), "rx_bad_cdr"),
    ],
)
def test_a_frame_that_cannot_be_used_is_dropped_by_name(frame, reason):
    link = make_link(2, pdu_size=220)
    assert link.hear(compressed(frame), 0.0) == []
    assert received(link)[1, 0].dropped == {reason: 1}
    assert link.audit() == []


@law(200)
@given(st.binary(max_size=200))
def test_any_bytes_inflate_to_no_more_than_they_may(data):
    whole = zstandard.compress(TEXT)
    for frame in (data, whole[: len(whole) // 2] + data, whole[:5] + data):
        message, _ = Inflated({}).expand(frame, 1000)
        assert len(message) <= 1000


def test_lifespan_and_size_hold_where_messages_arrive():
    sender, receiver = make_link(1, pdu_size=220), make_link(2, pdu_size=220)
    receiver.set_policies({0: TopicPolicy(lifespan_s=0.5), 1: TopicPolicy(max_bytes=50)})
    for topic in (0, 1):
        sender.submit(topic, TEXT[:90], 0.0)
    (pdu,) = send_all(sender, 0.3)
    assert [m.topic_id for m in receiver.hear(pdu, 10.0, None, 10.19)] == [0]
    assert received(receiver)[1, 1].dropped["rx_size_cap"] == 1
    sender.submit(0, TEXT[:90], 1.0)
    (late,) = send_all(sender, 1.3)
    assert receiver.hear(late, 10.0, None, 10.21) == []
    assert received(receiver)[1, 0].dropped["rx_expired"] == 1
    assert receiver.audit() == []


@pytest.mark.slow
@law(30)
@given(st.integers(0, 2**32))
def test_commands_are_handed_over_within_their_lifespan_and_others_begin_within_it(seed):
    rng = Random(seed)
    policy = TopicPolicy(lifespan_s=0.2, deadman_s=rng.choice((0.0, 1.0)))
    sender, receiver = make_link(1, pdu_size=64, seed=seed), make_link(2, pdu_size=64, seed=seed)
    for link in (sender, receiver):
        link.set_policies({0: policy})
    born, handed, now = {}, 0, 0.0
    for i in range(200):
        now += rng.random() * 0.05
        payload = i.to_bytes(4, "big") + bytes(rng.randrange(150))
        born[payload[:4]] = now
        sender.submit(0, payload, now)
        if rng.random() < 0.6 and (burst := compose(sender, now, 4)):
            sender.confirm(burst, Outcome.SENT, now)
            held_s = rng.random() * 0.15
            for pdu in burst.pdus:
                for message in receiver.hear(pdu, now, None, now + held_s):
                    handed += 1
                    counts_until = now if policy.deadman_s else message.began_at
                    age_s = counts_until + held_s - born[message.payload[:4]]
                    assert age_s <= 0.2, f"seed {seed}"
        sender.handle_timers(now)
        receiver.handle_timers(now)
    assert handed > 20, f"seed {seed}: positive control"
    assert sender.audit() == receiver.audit() == []


def test_a_message_begun_and_not_gone_on_with_is_given_up():
    """Receivers wait half a second; the rest would be sent in vain."""
    link = make_link(pdu_size=64)
    link.submit(0, bytes(400), 0.0)
    burst = compose(link, 0.0, 2)
    link.confirm(burst, Outcome.SENT, 0.0)
    assert compose(link, 0.6, 9) is None
    assert reasons(link) == {"tx_stalled": 1}
    assert link.audit() == []


def test_a_policy_that_changes_applies_to_what_comes():
    link = make_link(pdu_size=220)
    link.submit(0, bytes(20), 0.0)
    link.set_policy(0, TopicPolicy(qos="urgent", dst=7))
    link.submit(0, bytes(20), 0.0)
    assert classes_queued(link)[Qos.URGENT] == 1
    assert classes_queued(link)[Qos.DEFAULT] == 1
    assert link.submit(0, bytes(20), 0.0, Overrides(Qos.BULK)) is None


def test_a_frame_of_many_times_its_size_is_neither_sent_nor_taken_in_the_clear():
    """Unless the topic says how large its messages may be."""
    zeros, policy = bytes(1 << 17), TopicPolicy(compress="zstd")
    for max_bytes, n_pdus in ((0, 100), (1 << 17, 0)):
        link = make_link(pdu_size=1024, hears_self=True)
        link.set_policy(0, msgspec.structs.replace(policy, max_bytes=max_bytes))
        assert link.submit(0, zeros, 0.0) is None
        pdus = send_all(link)
        assert len(pdus) > n_pdus
        assert (len(pdus) < 5) == (n_pdus == 0)
        heard = [message for pdu in pdus for message in link.hear(pdu, 0.0)]
        assert [message.payload for message in heard] == [zeros]
    stranger = make_link(own_id=2, pdu_size=1024, seed=2)
    for pdu in pdus:
        assert stranger.hear(pdu, 0.0) == []
    assert received(stranger)[1, 0].dropped["rx_inflates"] == 1


@pytest.mark.parametrize(("deadman_s", "is_told"), [(0.5, True), (0.7, False)])
def test_a_dead_man_that_stops_a_robot_between_two_turns_is_named(deadman_s, is_told):
    sender, receiver = make_link(1), make_link(2, seed=2)
    tdma = AccessParams(policy="tdma", nodes=[1, 2], slot_s=0.3)
    traits = PduLinkTraits(senses=True, shares_air=True, longest_burst_s=(0.01,))
    receiver.use(receiver.attach(traits, tdma, RateParams()))
    receiver.set_policy(0, TopicPolicy(deadman_s=deadman_s))
    sender.submit(0, CDR + bytes(48), 0.0)
    (message,) = receiver.hear(compose(sender, 0.0).pdus[0], 0.0)
    receiver.delivered(message, 0.0)
    assert not any("deadman_s" in each for each in receiver.notices(0.1))
    assert receiver.take_silent(1.0) == [(1, 0)]

    def told(at):
        words = "a turn to send comes only every 0.6"
        return [each for each in receiver.notices(at) if words in each]

    assert bool(told(1.0)) == is_told
    # It lasts until the policy is another one.
    receiver.set_policy(0, TopicPolicy())
    assert told(2.0) == []
