"""The parts of the receive side, each alone: what is announced, held, counted and handed over."""

from math import inf
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import Qos
from sdrlinkd.link.queue import Inflated, PolicyTable, TopicPolicy
from sdrlinkd.link.receive import (
    Ages,
    Deadman,
    Delivered,
    Latency,
    Neighbor,
    Neighbors,
    Parts,
    RecordHeard,
    Retain,
    SequenceTrack,
    can_be_true,
)
from sdrlinkd.link.receive.testing import (
    MOST_TALLIES,
    Acceptance,
    AirHeard,
    Completion,
    Handover,
    HeardRecords,
    Held,
    Origin,
    OwnPdus,
    RecentCommands,
    RepeatedPdus,
    RxLedger,
    UndeclaredMessages,
    Whole,
)
from sdrlinkd.link.topics import HeardTopic, HeardTopics
from sdrlinkd.wire import (
    PARTS,
    Beacon,
    Contact,
    Description,
    Entry,
    Flows,
    FoundNumbers,
    Frame,
    Grant,
    KeyTold,
    LinkReport,
    LostNumbers,
    Parity,
    Pdu,
    PduBuilder,
    Receipt,
    RegistryDigest,
    Repeat,
    Stamp,
    TopicPiece,
    Waits,
    Want,
    Wanted,
    build_records,
    make_registry,
    pieces,
)
from tests.laws import law
from tests.link.world import compose, make_link

TOPICS = make_registry([("odom", "nav_msgs/Odometry"), ("cmd_vel", "geometry_msgs/Twist")])
FULL = make_registry([(f"t{i}", "a/B") for i in range(16)])
ABOUT = Description("scan", "sensor_msgs/msg/LaserScan")
DECLARED = HeardTopic(20, "scan", "sensor_msgs/msg/LaserScan", ABOUT)


def heard_topics():
    return HeardTopics(TOPICS, True, lambda _: bytes(8))


def track(*numbers, at=0.0):
    """A track that has heard these numbers, which were told."""
    made = SequenceTrack()
    for number in numbers:
        made.heard(number & 0xFF, number, at, number)
    return made


@pytest.mark.parametrize(
    ("held", "n", "is_true"),
    [(0, 1, True), (20_000, 1, True), (20_001, 1, False), (5, 0, False), (5, 63, True),
     (5, 64, False)],
)  # fmt: skip
def test_a_repeat_names_as_many_pdus_as_a_burst_holds_and_no_long_time(held, n, is_true):
    repeat = Repeat(9, 10, held, n)
    assert can_be_true(repeat) == is_true
    known, repeated = track(90, 100), RepeatedPdus()
    assert repeated.take(repeat, 9, known, 1.0) == is_true
    assert bool(repeated) == is_true
    assert known.first_at(89, 0.0) == (0.0 if is_true else -inf)


def test_what_a_burst_repeats_was_sent_before_as_long_as_told():
    repeated, known = RepeatedPdus(), track(10, 20)
    assert repeated.take(Repeat(8, 12, 300, 2), 9, known, 1.0), "of another's PDUs"
    assert not repeated
    repeated.take(Repeat(9, (1 << 32) - 1, 300, 3), 9, known, 1.0)
    repeated.take(Repeat(9, 15, 500, 1), 9, known, 1.004)
    for seq, number, first_at in ((255, (1 << 32) - 1, 0.97), (0, 0, 0.97), (1, 1, 0.97)):
        assert repeated.find(9, seq, 1.0045, known) == (number, pytest.approx(first_at))
    assert repeated.find(9, 15, 1.005, known) == (15, pytest.approx(0.954))
    assert repeated.find(9, 2, 1.0, known) is None
    assert repeated.find(8, 15, 1.0, known) is None
    repeated.take(Repeat(9, 16, 500, 1), 9, known, 1.2)
    assert repeated.find(9, 15, 1.2, known) is None, "the next burst tells anew"
    assert repeated.find(9, 16, 1.2, known).number == 16


@pytest.mark.parametrize(
    ("number", "later_s", "is_found"),
    [
        (15, 0.3, True),
        (15, 0.5, True),
        (15, 0.51, False),
        (15, -0.01, False),
        (10, 0.3, False),  # It is here.
        (20, 0.3, False),
        (21, 0.3, False),  # A new one has this sequence number.
    ],
)
def test_a_later_burst_brings_only_what_is_missing(number, later_s, is_found):
    repeated, known = RepeatedPdus(), track(10, 20)
    repeated.take(Repeat(9, number, 300, 1), 9, known, 1.0)
    found = repeated.find(9, number, 1.0 + later_s, known)
    assert (found is not None) == is_found
    assert bool(repeated) == (0 <= later_s <= 0.5), "what is too old is forgotten"
    far = track(10, 15 + 128)
    repeated.take(Repeat(9, 15, 300, 2), 9, far, 3.0)
    assert repeated.find(9, 15, 3.1, far) is None, "too far behind"
    assert repeated.find(9, 16, 3.1, far) == (16, pytest.approx(2.97))
    repeated.clear()
    assert not repeated


def test_a_pdu_with_commands_is_known_again_for_ten_seconds():
    acceptance = accepting()
    acceptance.set_policy(1, TopicPolicy(deadman_s=0.5))
    recent = RecentCommands(acceptance, heard_topics())

    def comes(at, octets=b"x", *topic_ids):
        entries = [Entry(each, 0, 0, 1, b"") for each in topic_ids or (0, 1)]
        return recent.has_heard(Pdu(0, False, 9, 255, 0, 1, entries), octets, at)

    assert not comes(0.0)
    assert comes(10.0)
    assert not comes(0.0, b"x", 0), "no commands"
    assert not comes(10.001)
    assert comes(10.002)
    recent.begin_anew()
    assert not comes(10.0)
    for i in range(4097):
        assert not comes(11.0, i.to_bytes(2, "big"))
    assert comes(11.0, b"\0\1")
    assert not comes(11.0, b"x"), "there are too many"


def test_three_foreign_pdus_within_ten_seconds_are_of_a_double():
    own = OwnPdus()
    octets = bytes(range(20))
    for at in (0.0, 1.0, 2.0):
        assert not own.has_double(at)
        own.heard(octets, at)
    assert own.has_double(9.9)
    assert not own.has_double(10.0)
    own.heard(octets, 10.5)
    assert own.has_double(10.9)
    own.begin_anew()
    assert not own.has_double(10.9)
    own.begins.append(octets[:4] + octets[5:10])
    for at in range(5):
        own.heard(octets[:4] + b"\x77" + octets[5:10] + b"other", 0.1 * at)
    assert not own.has_double(0.5), "a relayed copy of ours"


def accepting(registry=TOPICS, most=1 << 20, takes_all=False, is_sealed=True):
    return Acceptance(registry, Inflated({}), most, takes_all, is_sealed)


ODOM = HeardTopic(0, "odom", "nav_msgs/msg/Odometry")
FOR_OTHER = HeardTopic(20, "@5/scan", "sensor_msgs/msg/LaserScan", ABOUT._replace(name="@5/scan"))


@pytest.mark.parametrize(
    ("sources", "of_own", "of_declared", "of_other"),
    [([], True, True, True), ([9], True, True, False), ([5], False, False, False),
     ([5, 9], True, True, True)],
)  # fmt: skip
def test_messages_are_taken_from_those_allowed_also_over_others(
    sources, of_own, of_declared, of_other
):
    acceptance = accepting()
    acceptance.set_policy(0, TopicPolicy(from_=sources))
    acceptance.set_table(PolicyTable({"scan": TopicPolicy(from_=sources)}))
    taken = [acceptance.takes_from(topic, 9) for topic in (ODOM, DECLARED, FOR_OTHER)]
    assert taken == [of_own, of_declared, of_other]


def test_policies_are_by_id_in_the_registry_and_by_name_elsewhere():
    acceptance = accepting()
    command, proven = TopicPolicy(deadman_s=0.5), TopicPolicy(unproven="deliver")
    assert not acceptance.delivers_unproven
    acceptance.set_policy(0, command)
    acceptance.set_table(PolicyTable({"odom": TopicPolicy(depth=3), "scan": proven}))
    assert acceptance.policy_of(ODOM) is command
    assert acceptance.policy_of(DECLARED) == acceptance.policy_of(FOR_OTHER) == proven
    assert acceptance.policy_of(None) == acceptance.policy_of(ODOM._replace(base=1))
    assert [acceptance.commands(each) for each in (ODOM, DECLARED, None)] == [True, False, False]
    assert [acceptance.takes_unproven(each) for each in (ODOM, DECLARED)] == [False, True]
    assert acceptance.delivers_unproven
    acceptance.set_table(PolicyTable({}))
    assert not acceptance.delivers_unproven
    acceptance.set_policy(1, proven)
    assert acceptance.delivers_unproven
    assert accepting(takes_all=True).takes_unproven(ODOM)


@pytest.mark.parametrize(
    ("policy", "depth", "own", "declared", "drops_late"),
    [
        (TopicPolicy(), 0, 0, 0, (False, False)),
        (TopicPolicy(), 1, 0, 1, (False, True)),
        (TopicPolicy(), 2, 0, 2, (False, False)),
        (TopicPolicy(durability="transient_local", depth=3, lifespan_s=5.0), 2, 24, 3,
         (False, False)),
        (TopicPolicy(durability="transient_local"), 0, 8, 1, (False, True)),
        (TopicPolicy(late="drop"), 0, 0, 0, (True, True)),
        (TopicPolicy(deadman_s=1.0), 5, 0, 5, (True, True)),
    ],
)  # fmt: skip
def test_what_is_kept_for_later_and_what_comes_too_late(policy, depth, own, declared, drops_late):
    acceptance = accepting()
    acceptance.set_policy(0, policy)
    acceptance.set_table(PolicyTable({"scan": policy}))
    topic = DECLARED._replace(about=ABOUT._replace(depth=depth))
    lifespan_s = policy.lifespan_s or inf
    assert acceptance.retain(ODOM) == Retain(own, lifespan_s)
    assert acceptance.retain(topic) == Retain(declared, lifespan_s)
    assert (acceptance.drops_late(ODOM), acceptance.drops_late(topic)) == drops_late


@pytest.mark.parametrize(
    ("policy", "size", "origin_at", "reason"),
    [
        (TopicPolicy(), 4, None, None),
        (TopicPolicy(), 3, None, "rx_bad_cdr"),
        (TopicPolicy(max_bytes=10), 10, None, None),
        (TopicPolicy(max_bytes=10), 11, None, "rx_size_cap"),
        (TopicPolicy(lifespan_s=1.0), 9, 4.0, None),
        (TopicPolicy(lifespan_s=1.0), 9, 3.99, "rx_expired"),
        (TopicPolicy(lifespan_s=1.0), 9, None, "rx_no_age"),
        (TopicPolicy(lifespan_s=1.0, stamp=False), 9, None, None),
    ],
)
def test_a_message_is_handed_over_or_dropped_by_its_policy(policy, size, origin_at, reason):
    acceptance = accepting()
    acceptance.set_policy(0, policy)
    assert acceptance.judge(ODOM, bytes(size), False, origin_at, 0.0, 5.0) == (bytes(size), reason)
    without_ages = accepting(FULL)
    without_ages.set_policy(0, policy)
    expected = None if reason == "rx_no_age" else reason
    assert without_ages.judge(ODOM, bytes(size), False, origin_at, 0.0, 5.0)[1] == expected


@pytest.mark.parametrize(
    ("policy", "took_s", "reason"),
    [
        (TopicPolicy(lifespan_s=1.0), 2.0, None),
        (TopicPolicy(lifespan_s=1.0), 1.9, "rx_expired"),
        (TopicPolicy(lifespan_s=1.0, deadman_s=0.5), 2.0, "rx_expired"),
        (TopicPolicy(lifespan_s=1.0, qos="urgent"), 2.0, "rx_expired"),
    ],
)
def test_the_time_on_the_air_does_not_count_except_for_commands(policy, took_s, reason):
    acceptance = accepting()
    acceptance.set_policy(0, policy)
    assert acceptance.judge(ODOM, bytes(9), False, 2.0, took_s, 5.0)[1] == reason


def test_how_far_a_message_may_expand():
    import zstandard

    def judged(size, most=1 << 20, max_bytes=0, is_sealed=True):
        acceptance = accepting(most=most, is_sealed=is_sealed)
        acceptance.set_policy(0, TopicPolicy(max_bytes=max_bytes))
        frame = zstandard.ZstdCompressor().compress(bytes(size))
        assert 64 * len(frame) < 1 << 16
        payload, reason = acceptance.judge(ODOM, frame, True, None, 0.0, 5.0)
        assert payload == (b"" if reason else bytes(size))
        return reason

    assert (judged(100_000), judged(100_000, is_sealed=False)) == (None, "rx_inflates")
    assert (judged(65_536, is_sealed=False), judged(65_537, is_sealed=False)) == (
        None, "rx_inflates",
    )  # fmt: skip
    assert (judged(1000, most=1000), judged(1001, most=1000)) == (None, "rx_inflates")
    assert judged(1001, most=1000, is_sealed=False) == "rx_inflates"
    for is_sealed in (True, False):
        assert judged(100_000, 1000, 100_000, is_sealed=is_sealed) is None
        assert judged(100_001, 1000, 100_000, is_sealed=is_sealed) == "rx_inflates"


def whole(src=9, number=20, size=100, payload=None):
    return Whole(
        src, number, payload or bytes(size), False, None, (number, 0), 0.0, 0.0, 0.0, 1, None
    )  # fmt: skip


def test_messages_wait_a_second_for_the_declaration_of_their_topic():
    held = UndeclaredMessages()
    messages = [whole(src, number, 10 * number) for src in (8, 9) for number in (20, 21, 20)]
    for at, message in enumerate(messages):
        assert held.hold(message, at / 8) == []
    assert (len(held), held.n_bytes) == (6, 2 * (200 + 210 + 200) + 6 * 512)
    assert held.release(7, 20) == []
    assert held.release(8, 20) == [messages[0], messages[2]]
    assert held.release(8, 20) == []
    assert (len(held), held.n_bytes) == (4, 210 + 610 + 4 * 512)
    assert held.expire(1.124) == []
    assert held.expire(1.125) == [messages[1]]
    assert held.expire(1.5) == messages[3:5]
    assert held.of_source(9) == messages[5:]
    assert held.of_source(9) == held.of_source(8) == held.expire(9.0) == []
    assert (len(held), held.n_bytes) == (0, 0)


def test_of_too_many_or_too_large_ones_the_oldest_are_given_up():
    held = UndeclaredMessages()
    messages = [whole(number=i) for i in range(66)]
    assert [held.hold(each, 0.0) for each in messages] == [[]] * 64 + [
        [each] for each in messages[:2]
    ]
    assert held.hold(whole(src=8), 0.0) == []
    held = UndeclaredMessages()
    large = [whole(payload=bytes((6 << 20) - 512)) for _ in range(2)]
    assert [held.hold(each, 0.0) for each in large] == [[], []]
    assert held.hold(whole(size=0, payload=b"\0"), 0.0) == large[:1]
    held = UndeclaredMessages()
    full = bytes((6 << 20) - 512)
    for src in range(1, 9):
        assert held.hold(whole(src, payload=full), 0.0) == []
    assert held.hold(whole(3, payload=b"\0"), 0.0) == [whole(3, payload=full)]
    assert held.n_bytes == 7 * (6 << 20) + 513


def test_air_is_counted_once():
    air = AirHeard()
    for at, ended_at, heard_s in (
        (1.0, 1.5, 0.5), (1.0, 1.75, 0.75), (1.25, 1.5, 0.75), (1.5, 2.0, 1.0), (3.0, 3.25, 1.25),
    ):  # fmt: skip
        air.add(at, ended_at)
        assert air.heard_s == heard_s


def test_the_receive_ledger_names_everything():
    ledger = RxLedger(heard_topics())
    for _ in range(6):
        ledger.hear()
    ledger.use()
    for reason in ("rx_crc", "rx_relayed", "rx_not_for_us", "rx_not_for_us"):
        ledger.drop_pdu(reason)
    assert ledger.audit(Held(0, 0, 0)) == [
        "rx pdus: 6 entered, but 1 used + 1 rx_crc + 1 rx_relayed + 2 rx_not_for_us = 5"
    ]
    ledger.use()
    ledger.relay_refused()
    ledger.relayed_after_all()
    ledger.relayed_after_all()
    ledger.skip_records(2)
    ledger.repair(3)
    ledger.tally(9, 0).deliver(70)
    ledger.tally(9, 0).deliver(30)
    ledger.tally(9, 0).drop("rx_expired")
    ledger.tally(9, PARTS).drop("rx_part_lost")
    ledger.tally(8, 30).drop("rx_unknown_topic")
    ledger.tally(8, 1)
    report = ledger.report(Held(7, 2, 99))
    assert (report.pdus_heard, report.pdus_used, report.control_bad) == (6, 2, 2)
    assert report.pdus_dropped == {"rx_crc": 1, "rx_relayed": 2, "rx_not_for_us": 1}
    assert (report.started, report.delivered, report.held, report.held_bytes) == (7, 2, 2, 99)
    assert report.dropped == {"rx_expired": 1, "rx_part_lost": 1, "rx_unknown_topic": 1}
    assert ledger.fragments_repaired == 3
    assert ledger.audit(Held(7, 2, 99)) == []
    assert "8 entered" in ledger.audit(Held(8, 2, 99))[0]
    told = [
        (each.src, each.topic_id, each.name, each.delivered, each.delivered_bytes, each.pdr)
        for each in ledger.report_topics()
    ]
    assert told == [
        (8, 1, "/cmd_vel", 0, 0, None), (8, 30, "(topic id 30)", 0, 0, 0.0),
        (9, 0, "/odom", 2, 100, pytest.approx(2 / 3)), (9, PARTS, "(parts)", 0, 0, 0.0),
    ]  # fmt: skip
    assert ledger.counters()["rx", 9, 0] == 2
    assert ledger.counters()["delivered_bytes", 9, 0] == 100


def test_a_topic_that_falls_silent_is_told_once():
    deadman = Deadman()
    assert deadman.next_at == inf
    for src, topic_id, at in ((1, 5, 1.0), (2, 5, 1.5), (1, 6, 2.0), (1, 5, 3.0)):
        deadman.fresh(src, topic_id, at, 0.5)
    assert (deadman.next_at, deadman.take_due(1.99)) == (2.0, [])
    assert deadman.take_due(2.5) == [(2, 5), (1, 6)]
    assert deadman.take_due(2.5) == []
    deadman.fresh(2, 5, 2.5, 0.5)
    deadman.disarm(2, 5)
    deadman.disarm(2, 5)
    deadman.fresh(1, 6, 2.75, 0.5)
    deadman.forget(5)
    assert deadman.take_due(9.0) == [(1, 6)]
    assert deadman.stops == {(2, 5): 1, (1, 6): 2}


def message(src=9, topic=ODOM, origin_at=1.0, began_at=1.25):
    return Delivered(
        src, topic.base, b"", 1, 0, origin_at, began_at + 0.25, 1, None, began_at, began_at + 0.375,
        topic.base, topic,
    )  # fmt: skip


def test_the_age_at_handover_and_its_parts():
    handover = Handover()
    assert handover.report(9, 0) == (None, None, None, None, 0, 0.0)
    assert handover.deliver(message(origin_at=None), TopicPolicy(), 2.0) is None
    assert handover.report(9, 0).latency is None
    assert message(origin_at=None).parts(2.0) == (0.0, 0.25, 0.125, 0.375)
    assert handover.deliver(message(), TopicPolicy(), 2.0) == 1.0
    report = handover.report(9, 0)
    assert (report.last_ms, report.p50_ms, report.p99_ms, report.stops) == (1e3, 1e3, 1e3, 0)
    told = report.latency
    assert (told.wait_ms, told.reassembly_ms, told.air_ms, told.handover_ms) == (
        250, 250, 125, 375,
    )  # fmt: skip
    assert (told.period_ms, told.jitter_ms, told.queue_ms) == (None, None, None)
    handover.take_waits(9, Waits(1, 1, 1, 1))
    handover.take_waits(9, Waits(0, 0, 0, 0))
    assert handover.report(9, 0).latency.queue_ms is None, "it did not wait"
    handover.take_waits(9, Waits(0, 50, 30, 20))
    handover.deliver(message(), TopicPolicy(), 2.25)
    told = handover.report(9, 0).latency
    assert (told.queue_ms, told.access_ms, told.again_ms) == (125, 75, 50)
    assert (told.period_ms, told.jitter_ms) == (250, 0)
    assert handover.report(9, 1).latency is None


def test_commands_of_a_robot_over_whatever_way_are_one_stream():
    handover, command = Handover(), TopicPolicy(deadman_s=0.5)
    direct = message(5, DECLARED)
    over = message(9, FOR_OTHER)
    other = message(9, DECLARED)
    assert handover.silence_at == inf
    handover.deliver(message(5), TopicPolicy(), 1.0)
    assert handover.silence_at == inf
    for at, each in ((1.0, direct), (1.1, over), (1.2, other)):
        handover.deliver(each, command, at)
    assert handover.silence_at == 1.7, "the way of before is not waited for"
    assert handover.take_silent(1.7) == [(9, 20)]
    handover.deliver(over, command, 2.0)
    handover.deliver(direct, command, 2.1)
    handover.deliver(direct, command, 2.2)
    assert handover.take_silent(9.0) == [(5, 20)]
    assert handover.report(5, 20).stops == handover.report(9, 20).stops == 1
    handover.deliver(direct, command, 10.0)
    handover.forget(20)
    assert handover.silence_at == inf


def test_quantiles_are_of_the_recent_ages():
    latency = Latency()
    assert (latency.last_ms(), latency.quantile_ms(0.5), latency.period_ms()) == (None, None, None)
    assert latency.parts() == (0.0, 0.0, 0.0, 0.0)
    for i in range(1, 301):
        latency.add(Parts(i / 1000, 0.0, 0.0, i / 1000), i / 8)
    assert latency.last_ms() == pytest.approx(600)
    for q, rank in ((0.0, 45), (0.5, 173), (0.99, 298), (1.0, 300)):
        assert latency.quantile_ms(q) == pytest.approx(2 * rank)
    assert latency.parts().wait_s == pytest.approx((45 + 300) / 2000)
    assert latency.period_ms() == (125, 0)
    told = latency.percentiles_ms()
    assert list(told) == ["50", "90", "99", "99.9", "max"]
    assert told["90"] == pytest.approx(540, rel=0.02)
    assert told["max"] == pytest.approx(600, rel=0.02)


def test_old_stamps_are_forgotten_unless_their_messages_are_held():
    ages = Ages(timeout_s=1.0)
    for entry_id, at in ((1, 0.0), (2, 0.25), (3, 0.5), (1, 0.75)):
        ages.stamp(9, Stamp(0, entry_id, 250_000, entry_id == 1), at)
    assert ages.look(9, 0, 1) == (0.5, 0.75, True)
    assert ages.look(9, 0, 7) == ages.look(8, 0, 1) == (None, 0.0, False)
    ages.expire(1.5, lambda *key: key == (9, 0, 2))
    assert [ages.look(9, 0, each).at for each in (1, 2, 3)] == [0.5, 0.0, None]
    assert len(ages) == 2
    ages.expire(1.75, lambda *_: False)
    assert len(ages) == 0
    for i in range(65):
        ages.stamp(9, Stamp(0, i, 0), 2.0)
    assert len(ages) == 64
    assert ages.take(9, 0, 0).at is None
    assert (ages.take(9, 0, 1).at, ages.take(9, 0, 1).at, ages.take(7, 0, 1).at) == (
        2.0, None, None,
    )  # fmt: skip


def records_of(*records, dst=255, is_relayed=False, neighbor=None, **admitted):
    """The events that follow from records of robot 9 at robot 2, and what declares a topic."""
    declared = []
    completion = SimpleNamespace(declared=lambda *args: declared.append(args[:3]))
    heard = HeardRecords(2, heard_topics(), completion)
    told = {"at": 1.0, "was_seen": False, "may_schedule": True, "is_proven": True, **admitted}
    events, pdu = [], Pdu(0, False, 9, dst, 0, 1, [])
    heard.take(
        pdu, SimpleNamespace(**told), neighbor or Neighbor(9), records, is_relayed, 1.5, events
    )
    assert all(each[:1] + each[2:] == (9, 1.0) for each in events)
    return [each.record for each in events], declared


FRAME, GRANT, BEACON = Frame(1, 0, 2, 3), Grant(1, 2, 3), Beacon(1, 2)
REPORT, FLOWS = LinkReport(2, 40, 0, 1), Flows(9, 1)


@pytest.mark.parametrize(
    ("how", "used"),
    [
        ({}, [BEACON, FRAME, GRANT, REPORT, FLOWS]),
        ({"is_relayed": True}, []),
        ({"was_seen": True}, [REPORT, FLOWS]),
        ({"may_schedule": False}, [BEACON, REPORT, FLOWS]),
        ({"is_proven": False}, [BEACON, FRAME, GRANT]),
    ],
)
def test_records_count_as_far_as_somebody_vouches_for_them(how, used):
    elsewhere = (
        Parity(0, 1, 2, 1, 0, 0, 1, 2, b"x"), Stamp(0, 1, 2), Contact(bytes(8)),
        KeyTold(0, False, bytes(4)), LostNumbers(0, bytes(4), bytes(8)),
        FoundNumbers(2, bytes(8), 0, 0, None),
    )  # fmt: skip
    given_records = (BEACON, FRAME, GRANT, REPORT, FLOWS, *elsewhere)
    assert records_of(*given_records, **how) == (used, [])


def test_receipts_and_demand_count_where_they_concern_this_robot():
    for dst, node, is_used in ((2, 255, True), (255, 2, True), (255, 255, False), (3, 3, False)):
        receipt = Receipt(0, 1, 2, node)
        assert records_of(receipt, dst=dst)[0] == [receipt] * is_used
        assert records_of(receipt, dst=dst, is_relayed=True)[0] == [receipt] * is_used
        assert records_of(receipt, dst=dst, is_proven=False)[0] == []
    assert records_of(Wanted(2, b"\1"), Wanted(3, b"\1"))[0] == [Wanted(2, b"\1")]
    digest, neighbor = RegistryDigest(bytes(8), b""), Neighbor(9)
    assert records_of(digest, neighbor=neighbor, is_proven=False)[0] == []
    assert neighbor.digest == digest
    (piece,) = pieces(20, ABOUT, 200)
    assert records_of(piece, piece) == ([], [(9, 20, 1.5)])
    assert records_of(TopicPiece(20, 1, 0, 2, b"")) == ([], [])


@pytest.mark.parametrize(
    ("mean_db", "told", "believed"),
    [(None, 127, 127), (10.0, 40, 40), (10.0, 100, 100), (10.0, 101, 100), (10.0, -20, -20),
     (10.0, -21, -20)],
)  # fmt: skip
def test_a_report_differs_from_the_other_way_by_15_db_at_most(mean_db, told, believed):
    neighbor = Neighbor(9)
    neighbor.mean_snr_db = mean_db
    report = REPORT._replace(snr_quarter_db=told)
    assert records_of(report, neighbor=neighbor)[0] == [report._replace(snr_quarter_db=believed)]


def test_what_a_robot_wants_concerns_all_who_hear_it():
    want, events = Want(9, 1, 2, 3, 4, 5), []
    heard = HeardRecords(2, heard_topics(), None)
    for is_proven in (False, True):
        heard.take_wants(9, SimpleNamespace(at=1.0, is_proven=is_proven), (want, BEACON), events)
    assert events == [RecordHeard(9, want, 1.0)]


def test_quality_is_told_of_what_came_since_the_last_time():
    neighbor = Neighbor(9)
    assert neighbor.take_quality(0.0) is None
    for number, snr_db in ((1, 10.0), (2, 15.0), (5, None), (6, 20.0), (7, 10.0)):
        neighbor.track.heard(number, 0, 1.0)
        neighbor.count_new(1)
        neighbor.note_snr(snr_db, 1.0)
    assert (neighbor.snr_db, neighbor.mean_snr_db) == (10.0, 18.0)
    assert neighbor.take_quality(1.1) is None, "nothing came directly so late"
    assert neighbor.take_quality(0.0) is None, "nor since"
    neighbor.note_snr(18.0, 2.0)
    assert neighbor.take_quality(2.0) == (18.0, 2 / 7)
    assert neighbor.take_quality(2.0) is None
    neighbor.track.heard(3, 0, 3.0)
    neighbor.count_new(4, is_repaired=True)
    neighbor.note_snr(18.0, 3.0)
    assert neighbor.take_quality(2.0) is None, "what was repeated was lost at first"
    neighbor.track.heard(9, 0, 3.0)
    neighbor.count_new(4)
    neighbor.note_snr(18.0, 3.0)
    assert neighbor.take_quality(2.0) == (18.0, 0.5)
    assert (neighbor.heard, neighbor.repaired, neighbor.hops_left) == (7, 1, 4)
    neighbor.note_snr(None, 4.0)
    neighbor.track.heard(10, 0, 3.0)
    neighbor.count_new(4)
    assert neighbor.take_quality(2.0) is None, "nobody has measured"


@pytest.mark.parametrize("is_proven", [True, False])
def test_in_the_clear_another_boot_id_counts_the_second_time(is_proven):
    neighbor = Neighbor(9)
    told = [neighbor.take_boot_id(each, is_proven=is_proven) for each in (7, 7, 8, 7, 8, 8, 9, 6)]
    proven = [False, False, True, True, True, False, True, True]
    assert told == (proven if is_proven else [False] * 5 + [True] + [False] * 2)
    assert neighbor.reboots == sum(told)
    assert neighbor.boot_id == (6 if is_proven else 8)


def test_robots_are_present_for_ten_seconds_and_reported_by_id():
    own = TOPICS.digest()
    neighbors = Neighbors(2)
    assert neighbors.get(9) is None
    for src in (9, 2, 4):
        assert neighbors.meet(src) is neighbors.get(src)
        neighbors.get(src).heard_at(5.0 + src)
        neighbors.get(src).track.heard(1, 0, 1.0)
        neighbors.get(src).track.heard(3, 0, 1.0)
        neighbors.get(src).count_new(1)
        neighbors.get(src).note_snr(12.0, 5.0)
    assert neighbors.present(18.99) == [9, 4]
    assert neighbors.present(19.0) == [9]
    assert neighbors.present(24.0) == []
    neighbors.get(4).count_duplicate()
    neighbors.get(4).take_digest(own)
    other = make_registry([("odom", "nav_msgs/Odometry"), ("cmd", "geometry_msgs/Twist"),
                           ("more", "a/B")]).digest()  # fmt: skip
    neighbors.get(9).take_digest(other)
    first, me, last = neighbors.report(13.0, own)
    assert [each.src for each in (first, me, last)] == [2, 4, 9]
    assert [each.is_self for each in (first, me, last)] == [True, False, False]
    assert [each.registry for each in (first, me, last)] == ["unknown", "same", "differs"]
    assert [each.last_heard_s_ago for each in (first, me, last)] == [6.0, 4.0, 0.0]
    assert (me.pdus_heard, me.pdus_lost, me.per, me.duplicates, me.snr_db) == (1, 1, 0.5, 1, 12.0)
    assert Neighbors(1).report(0.0, own) == []
    assert neighbors.counters()["pdus", 9] == neighbors.counters()["lost", 9] == 1
    assert list(neighbors.take_qualities(5.0)) == [(9, 12.0, 0.5), (4, 12.0, 0.5)]
    (sentence,) = neighbors.disagreements(TOPICS, own)
    assert "robot 9 has a different registry: topic id 1 (ours: cmd_vel), 2 (not ours);" in sentence
    assert f"ours {own.overall.hex()[:8]}, theirs {other.overall.hex()[:8]}. Give" in sentence
    neighbors.get(9).take_digest(other.shortened())
    assert "different registry: some topic;" in neighbors.disagreements(TOPICS, own)[0]
    unheard = Neighbors(1)
    unheard.meet(3)
    assert unheard.report(1.0, own)[0].per == 0.0


def test_the_first_time_of_a_pdu_is_no_earlier_than_that_of_the_one_before():
    made = SequenceTrack()
    for number, at in ((10, 1.0), (12, 2.0), (13, 3.0)):
        made.heard(number, 0, at)
    assert made.first_at(13, 9.0) == 9.0, "the newest one"
    assert made.first_at(11, 3.0) == 3.0, "in the same burst"
    assert made.first_at(11, 5.0) == 1.0
    assert made.first_at(15, 5.0) == 3.0
    assert made.first_at(10 + 127, 5.0) == 3.0
    assert made.first_at(10, 5.0) == made.first_at(13 + 128, 5.0) == -inf
    made.distrust()
    assert made.first_at(11, 3.0) == 1.0
    assert made.heard(11, 0, 5.0, first_at=1.5)
    assert made.first_at(12, 6.0) == 1.5
    made.begin_anew()
    assert made.first_at(11, 6.0) == -inf


@pytest.mark.parametrize("newer", [13, 12 + 200])
def test_a_relay_does_not_tell_when_a_pdu_was_sent_first(newer):
    made = SequenceTrack()
    made.heard(10, 0, 1.0)
    made.heard(11, 0, 2.0, forwarded=Qos.BULK)
    made.heard(newer, 0, 3.0, forwarded=Qos.BULK)
    assert made.first_at(12, 4.0) == 1.0
    relayed = SequenceTrack()
    relayed.heard(10, 0, 1.0, forwarded=Qos.BULK)
    relayed.heard(12, 0, 2.0)
    assert relayed.first_at(11, 4.0) == -inf
    relayed.restart(50, 0, 5.0, is_forwarded=True)
    relayed.heard(52, 0, 6.0)
    assert relayed.first_at(51, 7.0) == -inf


def test_repeats_of_a_source_whose_numbers_are_not_known_are_no_younger_for_it():
    sender, receiver = make_link(1, beacon_s=0.0), make_link(2, beacon_s=0.0)
    bursts = []
    for number in range(3):
        sender.submit(0, bytes(8), 0.1 * number)
        bursts.append(compose(sender, 0.1 * number).pdus)
    for at, pdus in (0.0, bursts[0]), (0.2, bursts[2]), (0.3, bursts[1]):
        heard = [message for pdu in pdus for message in receiver.hear(pdu, at)]
    assert [receiver.delivered(message, 0.3) for message in heard] == [pytest.approx(0.3)]


@law(60)
@given(st.sets(st.integers(0, 300), min_size=1), st.integers(-5, 320))
def test_what_was_skipped_is_lacking_until_it_comes(numbers, asked):
    made = SequenceTrack()
    for number in sorted(numbers):
        before = made.newest
        made.heard(number & 0xFF, 0, 0.01 * number, number)
        assert list(made.skipped) == list(range(before + 1, number)) * (before >= 0)
        assert (made.number, made.newest, made.fills) == (number, number, False)
    newest = max(numbers)
    assert made.lacks(asked % (1 << 32)) == (asked < newest and asked not in numbers)
    assert made.lost == newest - min(numbers) + 1 - len(numbers)
    assert not made.lacks((newest - 20_000) % (1 << 32))
    assert made.lacks((newest - 19_999) % (1 << 32))


@pytest.mark.parametrize(
    ("ahead", "qos", "at", "number"),
    [
        (31, Qos.URGENT, 0.1, 231),
        (95, Qos.URGENT, 0.1, 295),
        (96, Qos.URGENT, 0.1, 296 - 256),
        (127, Qos.URGENT, 0.1, 327 - 256),
        (127, Qos.URGENT, 0.26, 327),
        (127, None, 0.1, 327),
        (128, Qos.URGENT, 0.26, 328 - 256),
        (31, Qos.BULK, 0.1, 231),
        (32, Qos.BULK, 0.1, 232 - 256),
        (32, Qos.BULK, 0.25, 232 - 256),
        (32, Qos.BULK, 0.26, 232),
        (90, Qos.LATENCY, 0.1, 290 - 256),
    ],
)
def test_a_relay_may_send_a_class_late_and_others_ahead(ahead, qos, at, number):
    """Where more urgent PDUs overtake, one may be 95 ahead; the least urgent ones are late."""
    made = SequenceTrack()
    for before, of_class in ((199, Qos.BULK), (200, Qos.BULK), (198, Qos.URGENT)):
        made.heard(before, before, 0.0, forwarded=of_class)
    made.heard((200 + ahead) & 0xFF, 3, at, forwarded=qos)
    assert made.number == number


def test_classes_are_told_apart_after_their_numbers_are_known():
    made = SequenceTrack()
    for before, of_class in ((199, Qos.BULK), (200, Qos.BULK), (198, Qos.URGENT)):
        made.heard(before, before, 0.0, forwarded=of_class)
    made.heard(201, 201, 0.0, 3 * 256 + 201, forwarded=Qos.BULK)
    made.heard((201 + 95) & 0xFF, 3, 0.1, forwarded=Qos.URGENT)
    assert made.number == 3 * 256 + 201 + 95


def test_a_track_that_has_heard_nothing():
    made = SequenceTrack()
    assert (made.newest, made.number, made.lost, made.restarts) == (-1, -1, 0, 0)
    assert not made.is_numbered
    made.restart(5, 1)
    assert (made.newest, made.lost, made.restarts) == (5, 0, 1)


@pytest.mark.parametrize(("newest", "is_new"), [(128, False), (129, True)])
def test_a_copy_is_known_among_the_last_128(newest, is_new):
    made = SequenceTrack()
    for number in range(newest + 1):
        assert made.heard(number, number, 0.5)
    assert made.heard(0, 0, 0.5) == is_new
    assert made.newest == (256 if is_new else newest)
    assert not made.heard(1, 1, 0.5, is_sealed=True), "T tells it from all others"
    assert not made.heard(2, 2, 0.5, forwarded=Qos.BULK)


def test_more_than_128_are_known_for_a_second():
    for at, known in ((1.0, (0, 1, 199)), (1.25, (1, 199)), (1.5, (1, 199)), (1.75, (199,))):
        for number in (0, 1, 199):
            made = SequenceTrack()
            for each in range(200):
                made.heard(each, each, 0.5 if each else 0.0)
            is_known = not made.heard(number, number, at, is_sealed=True)
            assert is_known == (number in known), (at, number)


def test_what_came_before_a_new_clock_is_not_looked_at():
    made = SequenceTrack()
    for number in range(200):
        made.heard(number, number, 100.0)
    made.begin_anew()
    for number in range(200, 450):
        assert made.heard(number & 0xFF, number, 1.0 + number / 100)
    assert made.lost == 0


@pytest.mark.parametrize(
    ("told", "later_s", "newest"),
    [
        (100 + 256, 0.0, 356),
        (100 + 257, 0.0, 101),
        (100 + 256 + 20_000, 1.0, 20_356),
        (100 + 257 + 20_000, 1.0, 101),
        (99, 1.0, 100),
    ],
)
def test_a_told_number_is_believed_as_far_as_a_source_can_count(told, later_s, newest):
    made = SequenceTrack()
    for number in (98, 100):
        made.heard(number, number, 4.0, number)
    assert made.heard(told & 0xFF if newest != 101 else 101, 7, 4.0 + later_s, told)
    assert (made.newest, made.fills) == (newest, told == 99)


COMMAND = TopicPolicy(deadman_s=1.0, from_=[9, 8])


def ended(*messages):
    """The events that follow from messages of robot 9, or of others."""
    topics, acceptance = heard_topics(), accepting()
    acceptance.set_policy(0, COMMAND)
    ledger, events = RxLedger(topics), []
    completion = Completion(topics, acceptance, ledger, Neighbors(2))
    for each in messages:
        completion.take(each, 7.0, events)
    return completion, ledger, events


def command(origin_at, src=9, number=0, asks=False, **more):
    made = whole(src, number)._replace(origin=Origin(origin_at, 5.0, asks), stamped=(number, 3))
    return made._replace(**more)


def test_a_command_that_comes_after_a_newer_one_is_dropped():
    completion, ledger, events = ended(
        command(5.0), command(4.5), command(4.9995), command(None), command(4.5, src=8),
        command(1.0, number=1), command(0.5, number=1), command(5.5), command(5.25),
    )  # fmt: skip
    assert [each.origin_at for each in events] == [5.0, 4.9995, None, 4.5, 1.0, 0.5, 5.5]
    assert ledger.tally(9, 0).dropped == {"rx_outdated": 2}
    assert [each.number for each in events if (each.src, each.topic_id) == (9, 0)] == [1, 2, 3, 4]
    completion.forget(8, 7.0, events)
    completion.take(command(2.0, src=8), 7.0, events)
    completion.take(command(2.0), 7.0, events)
    assert [each.origin_at for each in events[7:]] == [2.0]
    completion.begin_anew()
    completion.take(command(2.0), 7.0, events)
    assert len(events) == 9


def test_each_message_ends_under_one_name_and_who_asks_is_told():
    for message_, reason in (
        (command(6.0, asks=True), "delivered"),
        (command(6.0, asks=True, number=3), "rx_unknown_topic"),
        (command(6.0, asks=True, src=7), "rx_denied"),
        (command(6.0, asks=True, is_proven=False), "rx_unproven"),
        (command(6.0, asks=True, payload=b""), "rx_bad_cdr"),
        (command(None, asks=True), "delivered"),
    ):
        _, ledger, events = ended(message_)
        src, number, origin_at = message_.src, message_.number, message_.origin.at
        age_s = None if origin_at is None else 1.0
        assert events[0] == (src, number, 3, reason, age_s, 7.0)
        assert len(events) == 1 + (reason == "delivered")
        dropped = {} if reason == "delivered" else {reason: 1}
        assert ledger.tally(src, number).dropped == dropped
    _, _, (only,) = ended(command(6.0))
    assert only[:8] == (9, 0, bytes(100), 1, 0, 6.0, 0.0, 1)


def test_messages_of_a_number_wait_for_its_declaration():
    topics = heard_topics()
    acceptance = accepting()
    ledger, events = RxLedger(topics), []
    completion = Completion(topics, acceptance, ledger, Neighbors(2))
    for number in (20, 21):
        completion.take(command(6.0, number=number), 7.0, events)
    (piece,) = pieces(20, ABOUT, 200)
    assert topics.take(9, piece)
    completion.declared(9, 20, 7.5, events)
    assert [each.topic.name for each in events] == ["scan"]
    completion.take(command(6.0, number=20), 7.5, events)
    assert len(events) == 2
    completion.expire(7.9, events)
    assert ledger.tally(9, 21).dropped == {}
    completion.expire(8.0, events)
    assert ledger.tally(9, 21).dropped == {"rx_unknown_topic": 1}
    completion.take(command(6.0, number=22, asks=True), 7.5, events)
    completion.forget(9, 8.0, events)
    assert events[2:] == [(9, 22, 3, "rx_unknown_topic", 2.0, 8.0)]
    (other,) = pieces(23, ABOUT._replace(name="odom"), 200)
    assert topics.take(9, other)
    completion.take(command(6.0, number=23), 8.0, events)
    assert ledger.tally(9, 23).dropped == {"rx_other_type": 1}
    completion.drop(9, 20, "rx_part_lost")
    assert ledger.tally(9, 20).dropped == {"rx_part_lost": 1}


def heard_pdu(link, number, at, *records, age_us=None):
    """A PDU of robot 1 with a message, and its age if that is given."""
    builder = PduBuilder(96)
    builder.add(0, number & 0xFF, 0, 1, bytes((0, 1, 0, 0)) + number.to_bytes(2, "big"))
    for record in records:
        assert builder.add_record(build_records([record]))
    if age_us is not None:
        assert builder.add_stamp(0, number & 0xFF, age_us)
    octets = builder.build(0, 1, 255, number & 0xFF, 1)
    return [link.delivered(each, at) for each in link.hear(octets, at, None, at, at + 0.125)]


def test_the_age_of_a_late_pdu_grows_by_all_the_time_for_which_it_may_have_been_sent_before():
    link = make_link(2, pdu_size=96)
    heard_pdu(link, 200, 100.0, Beacon(1, 0, 200))
    assert heard_pdu(link, 202, 100.5, age_us=1000) == [pytest.approx(0.001)]
    assert heard_pdu(link, 201, 101.5, age_us=1000) == [pytest.approx(1.501)]
    assert heard_pdu(link, 100, 101.5, Beacon(1, 1, 100), age_us=1000) == [pytest.approx(10.001)]


@pytest.mark.parametrize(("more", "is_believed"), [(0, True), (1, False)])
def test_how_far_a_source_can_count_is_measured_from_the_last_told_number(more, is_believed):
    made = SequenceTrack()
    for number, at in ((100, 4.0), (102, 9.0), (101, 9.5)):
        made.heard(number, number, at, number)
    told = 102 + 256 + 20_000 + more
    made.heard(told & 0xFF, 7, 10.0, told)
    assert (made.newest == told) == is_believed


def test_the_first_told_number_renumbers_what_was_heard_before():
    made = SequenceTrack()
    for seq in (10, 12):
        made.heard(seq, seq, 1.0, forwarded=Qos.BULK)
    assert made.heard(13, 13, 1.0, 3 * 256 + 13)
    assert (made.newest, made.number, made.lost, list(made.skipped)) == (781, 781, 1, [779])
    assert made.heard(11, 11, 1.0)
    assert (made.number, made.fills, made.lost) == (779, True, 0)
    assert not made.heard(12, 12, 1.0)


def test_topics_beyond_the_most_that_are_counted_share_a_tally_of_their_robot():
    """The ledger still adds up, and the report has an end."""
    ledger = RxLedger(HeardTopics(TOPICS, True, lambda _: bytes(8)))
    n = 0
    for src in range(1, 251):
        for topic_id in range(16, 256):
            ledger.tally(src, topic_id).drop("rx_unknown_topic")
            n += 1
    told = ledger.report_topics()
    assert len(told) <= MOST_TALLIES + 250
    assert sum(each.dropped["rx_unknown_topic"] for each in told) == n
    assert ledger.report(Held(n, 0, 0)).dropped == {"rx_unknown_topic": n}
    assert ledger.audit(Held(n, 0, 0)) == []
    shared = [each for each in told if each.name == "(further topics)"]
    assert [each.src for each in shared] == list(range(5, 251))
    known = next(topic.id for topic in TOPICS.topics)
    ledger.tally(250, known).deliver(7)
    (own,) = [each for each in ledger.report_topics() if each.delivered]
    assert (own.src, own.topic_id) == (250, known)
