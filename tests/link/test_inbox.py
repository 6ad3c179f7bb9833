"""What a node accepts from the air, and what it refuses by name."""

from random import Random

import pytest

from sdrlinkd.link import AccessParams, RateParams
from sdrlinkd.wire import Entry, Pdu, build
from tests.link.radios import LOCKSTEP
from tests.link.world import TOPICS, make_link, neighbors, received, rx, send_all


def pdu(src=1, dst=255, seq=0, topic_id=0, payload=b"\0\1\0\0data", total=1, hop=1):
    return build(Pdu(0, False, src, dst, seq, hop, [Entry(topic_id, 9, 0, total, payload)]), 64)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"short", "rx_short"),
        (bytes(64), "rx_entry"),
        (pdu()[:-1] + b"\xff", "rx_crc"),
        (pdu(src=2), "rx_own"),
        (pdu(dst=7), "rx_not_for_us"),
        (pdu(topic_id=15, total=2), "rx_control_bad"),
        (pdu(topic_id=15, payload=b"\1\x06short"), "rx_control_bad"),
        (pdu(topic_id=15, payload=b"\xee\x00"), "rx_control"),
    ],
)
def test_refused_by_name(data, reason):
    link = make_link(2, pdu_size=64)
    assert link.hear(data, 0.0) == []
    assert dict(rx(link).pdus_dropped) == {reason: 1}
    assert link.audit() == []


def test_duplicates_are_refused_also_from_a_relay():
    link = make_link(2, pdu_size=64)
    assert len(link.hear(pdu(hop=3), 0.0)) == 1
    assert link.hear(pdu(hop=3), 0.1) == []
    assert link.hear(pdu(hop=2), 0.2) == []
    assert rx(link).pdus_dropped["rx_dup"] == 2


def test_what_is_for_us_arrives():
    link = make_link(2, pdu_size=64)
    assert len(link.hear(pdu(dst=2), 0.0)) == 1


def test_messages_of_unknown_topics_and_without_cdr_are_named():
    link = make_link(2, pdu_size=64)
    link.hear(pdu(topic_id=9), 0.0)
    link.hear(pdu(seq=1, payload=b"abc"), 0.0)
    assert received(link)[1, 9].dropped["rx_unknown_topic"] == 1
    assert received(link)[1, 0].dropped["rx_bad_cdr"] == 1
    assert link.audit() == []


def test_messages_carry_a_number_and_the_losses_before_them():
    link = make_link(2, pdu_size=64)
    messages = [m for seq in (0, 1, 4) for m in link.hear(pdu(seq=seq), 0.0)]
    assert [(m.number, m.lost_pdus) for m in messages] == [(1, 0), (2, 0), (3, 2)]


def test_the_snr_in_the_report_is_not_that_of_one_burst_alone():
    link = make_link(2, pdu_size=64)
    for seq in range(30):
        link.hear(pdu(seq=seq), 0.0, 15.0 + (-1) ** seq)
    (neighbor,) = link.report(0.0).neighbors
    assert abs(neighbor.snr_db - 15) < 0.2


def test_a_different_registry_is_named_on_both_sides():
    other = (*TOPICS[:2], ("imu_raw", "sensor_msgs/Imu"))
    one, two = make_link(1, beacon_s=1.0), make_link(2, topics=other, beacon_s=1.0)
    for a, b in ((one, two), (two, one)):
        for data in send_all(a):
            b.hear(data, 0.0)
    for link, src in ((one, 2), (two, 1)):
        assert neighbors(link)[src].registry == "differs"
        (notice,) = link.notices(0.0)
        assert notice.startswith(f"robot {src} has a different registry: topic id 2")


def test_a_reboot_is_seen_and_its_pdus_are_not_taken_for_duplicates():
    before, after = make_link(1, seed=1, beacon_s=1.0), make_link(1, seed=2, beacon_s=1.0)
    receiver = make_link(2, beacon_s=1.0)
    for link in (before, after):
        for second in range(40):
            link.submit(0, bytes(30), float(second))
            for data in send_all(link, now=float(second)):
                receiver.hear(data, 0.0)
    assert neighbors(receiver)[1].reboots == 1
    assert received(receiver)[1, 0].delivered == 80
    assert rx(receiver).pdus_dropped["rx_dup"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_any_bytes_keep_the_ledger(seed):
    rng = Random(seed)
    link = make_link(2, pdu_size=64)
    good = [pdu(src=rng.randrange(256), seq=rng.randrange(256)) for _ in range(50)]
    for _ in range(2000):
        data = bytearray(rng.choice(good))
        for _ in range(rng.randrange(3)):
            data[rng.randrange(64)] = rng.randrange(256)
        if rng.random() < 0.5:
            import binascii

            data[-2:] = binascii.crc_hqx(bytes(data[:-2]), 0).to_bytes(2, "big")
        link.hear(bytes(data[: rng.choice((64, 64, 64, rng.randrange(64)))]), rng.random())
        assert link.audit() == [], f"seed {seed}"
    assert rx(link).pdus_used > 100


def test_air_is_heard_of_others_alone():
    link = make_link(2, pdu_size=64)
    for n in range(10):
        at = n / 10
        link.hear(pdu(src=1, seq=n), at, ended_at=at + 0.05)
        link.hear(pdu(src=2, seq=n), at, ended_at=at + 0.09)
        link.handle_timers(at + 0.1)
    assert link.report(1.0).air_heard_pct == pytest.approx(50)


def test_on_an_air_that_begins_anew_nothing_was_heard_before():
    link = make_link(2, pdu_size=64)
    link.hear(pdu(seq=1), 100.0)
    link.attach(LOCKSTEP, AccessParams(), RateParams())
    assert link.hear(pdu(seq=1), 0.5), "its number was of another time"
    assert not link.hear(pdu(seq=1), 0.6)


def test_a_pdu_that_comes_late_was_not_repeated():
    link = make_link(2, pdu_size=64)
    for seq in (0, 2, 1):
        link.hear(pdu(seq=seq), 0.0)
    (neighbor,) = link.report(0.0).neighbors
    assert (neighbor.pdus_lost, neighbor.pdus_repaired) == (0, 0)
