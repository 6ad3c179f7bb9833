"""The paper's packing policy (section 5.2), and our additions."""

import pytest

from sdrlinkd.link import Outcome, Overrides, Qos, TopicPolicy
from sdrlinkd.wire import BROADCAST, Beacon, RegistryDigest, Stamp, parse, parse_records
from tests.link.world import compose, layouts, make_link, send_all, tx


def no_stamps(link):
    link.set_policies({i: TopicPolicy(stamp=False) for i in range(len(link.registry))})
    return link


def test_paper_example_two_topics_at_220():
    link = no_stamps(make_link(pdu_size=220, greedy=False))
    link.submit(0, bytes(404), 0.0)
    link.submit(1, bytes(404), 0.0)
    assert layouts(send_all(link), 220) == [[(0, i, 4, 101), (1, i, 4, 101)] for i in range(4)]


def test_paper_table_6_odometry_alone_has_15_entries():
    link = no_stamps(make_link(pdu_size=64, greedy=False))
    link.submit(0, bytes(724), 0.0)
    got = layouts(send_all(link), 64)
    assert got == [[(0, i, 15, 51)] for i in range(14)] + [[(0, 14, 15, 10)]]


def test_min_fragment_outweighs_the_share_of_two():
    link = no_stamps(make_link(pdu_size=220, min_fragment=150, greedy=False))
    link.submit(0, bytes(300), 0.0)
    link.submit(1, bytes(300), 0.0)
    assert layouts(send_all(link), 220) == [
        [(0, 0, 2, 150)], [(1, 0, 2, 150)], [(0, 1, 2, 150)], [(1, 1, 2, 150)],
    ]  # fmt: skip


def test_k_freezes_at_the_first_fragment():
    link = no_stamps(make_link(pdu_size=220, greedy=False))
    link.submit(0, bytes(600), 0.0)
    link.confirm(compose(link, 0.0, 1), Outcome.SENT, 0.0)
    link.submit(1, bytes(202), 0.0)
    rest = [entry for pdu in layouts(send_all(link), 220) for entry in pdu if entry[0] == 0]
    assert rest == [(0, 1, 3, 207), (0, 2, 3, 186)]


def test_round_robin_of_three_topics():
    link = no_stamps(make_link(pdu_size=220, greedy=False))
    for topic in range(3):
        link.submit(topic, bytes(202), 0.0)
    order = [tid for pdu in layouts(send_all(link), 220) for tid, *_ in pdu]
    assert order == [0, 1, 2, 0, 1, 2]


def test_greedy_adds_further_entries_of_the_topic():
    plain = no_stamps(make_link(pdu_size=220, greedy=False))
    greedy = no_stamps(make_link(pdu_size=220, greedy=True))
    for link in (plain, greedy):
        for _ in range(3):
            link.submit(0, bytes(50), 0.0)
    assert layouts(send_all(plain), 220) == [[(0, 0, 1, 50)]] * 3
    assert layouts(send_all(greedy), 220) == [[(0, 0, 1, 50)] * 3]


def test_lower_classes_fill_what_is_left():
    link = no_stamps(make_link(pdu_size=220))
    link.submit(1, bytes(60), 0.0, Overrides(qos=Qos.BULK))
    link.submit(0, bytes(100), 0.0, Overrides(qos=Qos.LATENCY))
    (pdu,) = send_all(link)
    assert layouts([pdu], 220) == [[(0, 0, 1, 100), (1, 0, 1, 60)]]
    assert parse(pdu, 220).qos == 1  # the highest class inside


@pytest.mark.parametrize(
    ("qos", "bits"), [(Qos.DEFAULT, 0), (Qos.LATENCY, 1), (Qos.BULK, 2), (Qos.URGENT, 3)]
)
def test_class_on_the_wire(qos, bits):
    link = make_link(pdu_size=220)
    link.submit(0, bytes(8), 0.0, Overrides(qos=qos))
    assert parse(send_all(link)[0], 220).qos == bits


def test_order_is_class_then_priority_then_expiry():
    link = no_stamps(
        make_link(pdu_size=64, greedy=False, topics=[(f"t{i}", "a/B") for i in range(6)])
    )
    submissions = [
        (0, Qos.BULK, 127, 10.0), (1, Qos.DEFAULT, 1, 10.0), (2, Qos.DEFAULT, 2, 9.0),
        (3, Qos.DEFAULT, 2, 5.0), (4, Qos.LATENCY, 0, 10.0), (5, Qos.URGENT, 0, 10.0),
    ]  # fmt: skip
    for topic, qos, priority, lifespan_s in submissions:
        link.submit(topic, bytes(51), 0.0, Overrides(qos, priority, None, lifespan_s))
    order = [entry[0] for pdu in layouts(send_all(link), 64) for entry in pdu]
    assert list(dict.fromkeys(order)) == [5, 4, 3, 2, 1, 0]


def test_destinations_never_share_a_pdu():
    link = no_stamps(make_link(pdu_size=220))
    link.submit(0, bytes(10), 0.0, Overrides(dst=2))
    link.submit(1, bytes(10), 0.0, Overrides(dst=3))
    link.submit(2, bytes(10), 0.0)
    pdus = [parse(pdu, 220) for pdu in send_all(link)]
    assert sorted(pdu.dst for pdu in pdus) == [2, 3, BROADCAST]


def test_a_message_of_255_fragments_and_one_octet_more():
    link = no_stamps(make_link(pdu_size=64))
    assert link.submit(0, bytes(255 * 51), 0.0) is None
    assert link.submit(0, bytes(255 * 51 + 1), 0.0) == "tx_too_big"
    assert layouts(send_all(link), 64)[-1] == [(0, 254, 255, 51)]


def test_a_large_message_gets_a_larger_k_among_others():
    link = no_stamps(make_link(pdu_size=220, greedy=False))
    link.submit(0, bytes(255 * 150), 0.0)
    link.submit(1, bytes(10), 0.0)
    first = layouts(send_all(link), 220)[0]
    assert first[0] == (0, 0, 255, 150)


def records_of(pdu, pdu_size):
    entries = parse(pdu, pdu_size).entries
    return [record for e in entries if e.topic_id == 15 for record in parse_records(e.payload)]


class TestStamp:
    def test_rides_in_spare_room_with_the_age_at_the_preamble(self):
        link = make_link(pdu_size=220)
        link.submit(0, bytes(100), 1.0)
        (pdu,) = compose(link, 1.25, 8).pdus
        assert [record.age_us for record in records_of(pdu, 220)] == [250_000]

    def test_of_a_fragmented_message_needs_no_pdu_more(self):
        link = make_link(pdu_size=64)
        link.submit(0, bytes(724), 0.0)
        pdus = send_all(link)
        assert len(pdus) == 15
        assert [len(records_of(pdu, 64)) for pdu in pdus] == [0] * 14 + [1]

    def test_goes_ahead_when_the_last_entry_leaves_no_room(self):
        link = make_link(pdu_size=64)
        link.submit(0, bytes(51), 0.0)
        first, second = send_all(link)
        assert isinstance(records_of(first, 64)[0], Stamp)
        assert layouts([second], 64) == [[(0, 0, 1, 51)]]

    def test_can_be_switched_off_by_topic(self):
        link = no_stamps(make_link(pdu_size=64))
        link.submit(0, bytes(20), 0.0)
        assert records_of(send_all(link)[0], 64) == []

    def test_needs_a_control_channel(self):
        link = make_link(pdu_size=220, topics=[(f"t{i}", "a/B") for i in range(16)], beacon_s=1.0)
        link.submit(15, bytes(20), 0.0)
        (pdu,) = send_all(link)
        assert [entry.topic_id for entry in parse(pdu, 220).entries] == [15]


class TestBeacon:
    def test_alone_when_there_is_no_traffic(self):
        link = make_link(pdu_size=220, beacon_s=1.0)
        (pdu,) = send_all(link, now=5.0)
        beacon, digest = records_of(pdu, 220)
        assert isinstance(beacon, Beacon)
        assert digest.overall.hex() == link.report(5.0).registry_digest
        assert link.next_wakeup(5.0) == pytest.approx(6.0, abs=0.1)
        assert compose(link, 5.9, 8) is None
        assert len(send_all(link, now=6.0)) == 1

    def test_in_spare_room_of_a_broadcast_pdu(self):
        link = no_stamps(make_link(pdu_size=220, beacon_s=1.0))
        link.submit(0, bytes(50), 0.0)
        (pdu,) = send_all(link, now=5.0)
        assert len(parse(pdu, 220).entries) == 2

    @pytest.mark.parametrize("pdu_size", [32, 43, 44, 64])
    @pytest.mark.parametrize("topics", [1, 4, 15])
    def test_at_every_size_also_under_load(self, pdu_size, topics):
        link = make_link(
            pdu_size=pdu_size, topics=[(f"t{i}", "a/B") for i in range(topics)], beacon_s=1.0
        )
        seen = []
        for second in range(6):
            link.submit(0, bytes(pdu_size - 13), float(second))
            pdus = send_all(link, now=float(second))
            assert tx(link).queued == 0
            seen += [record for pdu in pdus for record in records_of(pdu, pdu_size)]
        assert sum(isinstance(record, Beacon) for record in seen) >= 4
        digests = [record for record in seen if isinstance(record, RegistryDigest)]
        assert len(digests) >= 4
        overall = link.report(0.0).registry_digest
        assert {digest.overall.hex() for digest in digests} == {overall}
