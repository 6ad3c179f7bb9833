"""The figures of a lab run, calculated by hand."""

import warnings

import msgspec
import pytest

from sdrlinkd.demo import Sample, Trace
from sdrlinkd.lab import LabReport
from sdrlinkd.lab.testing import BINS, Clock, classes_over_time, pair_result, robot_result
from sdrlinkd.reports import (
    BusReport,
    LinkReport,
    NeighborReport,
    PduLinkReport,
    RxReport,
    Snapshot,
    TxReport,
)

INFINITE = float("inf")


def trace_of(sent, received, name="cmd_vel"):
    """(time, payload) of what was sent; (age in s, payload) of what arrived."""
    trace = Trace({name: "geometry_msgs/msg/Twist"})
    trace.sent[name] = [Sample(at, payload) for at, payload in sent]
    trace.received[name] = [Sample(INFINITE, payload, age_s) for age_s, payload in received]
    return trace


def numbered(times):
    """A distinct message at each time."""
    return [(at, str(i).encode()) for i, at in enumerate(times)]


def result(trace, began_at=0.0, duration_s=10.0, hop_limit=None, counts=lambda _: True):
    clock = Clock(began_at=began_at, duration_s=duration_s)
    return pair_result(1, 2, trace, clock, hop_limit, counts)[0]


def test_all_that_was_sent_arrived():
    sent = numbered(range(10))
    pair = result(trace_of(sent, [(0.02, payload) for _, payload in sent]))
    assert (pair.sender, pair.receiver) == (1, 2)
    assert (pair.sent, pair.received, pair.pdr) == (10, 10, 1.0)
    assert pair.pdr_tenths == [1.0] * 10
    assert pair.bytes_identical
    assert pair.latency_ms == {"p50": 20, "p90": 20, "p99": 20, "max": 20}
    assert pair.topics == {"cmd_vel": [10, 10]}


def test_latency_is_the_age_in_lock_step_and_wall_time_without():
    sent = numbered([1.0, 2.0, 3.0])
    aged = trace_of(sent, [(0.01, b"0"), (0.02, b"1"), (0.06, b"2")])
    assert result(aged).latency_ms == {"p50": 20, "p90": 52, "p99": 59.2, "max": 60}
    timed = trace_of(sent, [])
    timed.received["cmd_vel"] = [Sample(1.5, b"0"), Sample(3.25, b"2")]
    assert result(timed).latency_ms["max"] == 500
    assert result(timed).received == 2


def test_a_message_whose_age_is_not_known_has_arrived_and_tells_no_latency():
    sent = numbered([1.0, 2.0, 3.0, 4.0])
    received = [(0.01, b"0"), (INFINITE, b"1"), (0.03, b"2"), (INFINITE, b"3")]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pair = result(trace_of(sent, received))
    assert (pair.received, pair.bytes_identical) == (4, True)
    assert msgspec.json.decode(msgspec.json.encode(pair), type=type(pair)) == pair
    assert pair.latency_ms == {"p50": 20, "p90": 28, "p99": 29.8, "max": 30}


def test_each_tenth_counts_what_was_sent_in_it():
    sent = numbered([0.0, 0.5, 0.9, 1.5, 3.0, 3.9, 9.99])
    got = [(0.02, sent[i][1]) for i in (0, 2, 3, 5)]
    pair = result(trace_of(sent, got))
    assert pair.pdr_tenths == [0.6667, 1.0, None, 0.5, None, None, None, None, None, 0.0]
    assert pair.pdr == pytest.approx(4 / 7)


def test_tenths_are_counted_from_the_beginning_and_hold_what_is_beside_them():
    sent = numbered([99.9, 100.0, 101.0, 119.9, 120.0, 130.0])
    got = [(0.02, sent[i][1]) for i in (0, 3, 5)]
    pair = result(trace_of(sent, got), began_at=100.0, duration_s=20.0)
    assert pair.pdr_tenths == [0.3333, *[None] * 8, 0.6667]


@pytest.mark.parametrize(("duration_s", "rate_hz"), [(3.0, 10), (6.0, 10), (7.0, 30), (2.0, 50)])
def test_what_is_sent_on_the_border_belongs_to_the_tenth_it_begins(duration_s, rate_hz):
    """Times are whole nanoseconds, as in a plan."""
    count = round(duration_s * rate_hz)
    each = count // 10
    sent = numbered([round(i * 1e9 / rate_hz) * 1e-9 for i in range(count)])
    for tenth in range(10):
        lost = range(tenth * each, (tenth + 1) * each)
        got = [(0.02, payload) for i, (_, payload) in enumerate(sent) if i not in lost]
        tenths = result(trace_of(sent, got), duration_s=duration_s).pdr_tenths
        assert tenths == [0.0 if i == tenth else 1.0 for i in range(10)]


def test_nothing_sent_is_nothing_lost():
    pair = result(Trace({}))
    assert (pair.sent, pair.received, pair.pdr) == (0, 0, 1.0)
    assert pair.pdr_tenths == [None] * 10
    assert pair.latency_ms == {}
    assert pair.bytes_identical


def test_nothing_received_is_all_lost():
    pair = result(trace_of(numbered([1.0, 2.0]), []))
    assert (pair.received, pair.pdr, pair.latency_ms) == (0, 0.0, {})
    assert pair.topics == {"cmd_vel": [2, 0]}


@pytest.mark.parametrize("foreign", [b"?", b"0"])
def test_bytes_that_nobody_sent_or_twice_are_told(foreign):
    pair = result(trace_of([(1.0, b"0")], [(0.02, b"0"), (0.03, foreign)]))
    assert (pair.received, pair.pdr) == (1, 1.0)
    assert not pair.bytes_identical


def test_topics_are_counted_apart():
    trace = trace_of(numbered([1.0, 2.0]), [(0.02, b"1")])
    trace.sent["odom"] = [Sample(1.0, b"o")]
    trace.sent["imu"] = [Sample(5.0, b"i")]
    trace.received["odom"] = [Sample(INFINITE, b"o", 0.01)]
    pair = result(trace)
    assert pair.topics == {"cmd_vel": [2, 1], "imu": [1, 0], "odom": [1, 1]}
    assert list(pair.topics) == sorted(pair.topics)
    assert (pair.sent, pair.received) == (4, 2)
    assert pair.pdr_tenths[1:6] == [0.5, 1.0, None, None, 0.0]


def neighbor(src, snr_db):
    return NeighborReport(
        src=src, is_self=False, last_heard_s_ago=0.1, pdus_heard=5, pdus_lost=0, per=0.0,
        duplicates=0, hops_left=0, reboots=0, snr_db=snr_db,
    )  # fmt: skip


def snapshot_of(**link):
    tx = TxReport(
        accepted=20, sent=13, queued=2, queued_bytes=99, in_flight=1, dropped={"tx_expired": 4},
        queued_by_class={}, entries=20, pdus_composed=18, pdus_sent=17, pdus_failed=1,
        bursts_sent=15, bursts_failed=1,
    )  # fmt: skip
    rx = RxReport(
        pdus_heard=30, pdus_used=20,
        pdus_dropped={"rx_control": 3, "rx_dup": 5, "rx_crc": 2}, started=9, delivered=7, held=0,
        held_bytes=0, dropped={"rx_incomplete": 2},
    )  # fmt: skip
    given = {
        "pdu_size": 64, "access": "tdma: 2 slots", "airtime_s": 0.5, "bursts_by_mcs": {2: 15},
        "bursts_late": 3, "mcs_changes": [(1.23456789, 2, 4)], "control_channel": True,
        "registry_digest": "x", "tx": tx, "rx": rx, "topics": [], "received": [],
        "neighbors": [neighbor(2, 24.567), neighbor(3, None)],
    }  # fmt: skip
    counters = {"pdus_bad": 6, "headers_bad": 7, "samples_lost": 8, "hub_outages": 9, "late": 3}
    return Snapshot(
        version="0", node=4, namespace="robot_4", state="running", taken_at_unix_ns=1,
        uptime_s=1.0, loop_lag_ms=0.0,
        carrier=PduLinkReport(kind="ether", state="up", detail="QPSK", counters=counters),
        bus=BusReport(runtime_dir="/x", received=0, published=7, control_requests=1),
        link=LinkReport(**{**given, **link}),
    )  # fmt: skip


def test_a_robot_tells_what_its_daemon_counted():
    robot = robot_result(snapshot_of(), [], 4.0)
    assert (robot.id, robot.carrier, robot.access) == (4, "QPSK", "tdma: 2 slots")
    assert robot.airtime_share == 0.125
    assert robot.bursts_by_mcs == {2: 15}
    assert robot.mcs_changes == [(1.234568, 2, 4)]
    assert robot.snr_db == {2: 24.57}
    assert (robot.bursts_sent, robot.bursts_failed, robot.bursts_late) == (15, 1, 3)
    assert (robot.pdus_sent, robot.pdus_heard) == (17, 30)
    assert (robot.pdus_bad, robot.headers_bad) == (6, 7)
    assert (robot.samples_lost, robot.hub_outages) == (8, 9)
    assert robot.left == 3
    assert robot.ledger_adds_up


def test_dropped_is_what_was_lost_and_not_what_is_meant_to_end_so():
    dropped = robot_result(snapshot_of(), [], 4.0).dropped
    assert dropped == {"rx_crc": 2, "rx_incomplete": 2, "tx_expired": 4}
    assert list(dropped) == sorted(dropped)


def test_a_ledger_that_does_not_add_up_is_told():
    assert not robot_result(snapshot_of(), ["3 are missing"], 4.0).ledger_adds_up


def test_a_report_is_json_and_back():
    sent = numbered([1.0, 2.0])
    report = LabReport(
        scenario="s", title="", pace="lockstep", seed=1, duration_s=10.0, source="x", pdr=0.5,
        worst_pdr=0.5, robots=[robot_result(snapshot_of(), [], 4.0)],
        pairs=[result(trace_of(sent, [(0.02, b"1")]))], out_of_reach=[(1, 3)], damage="",
    )  # fmt: skip
    assert msgspec.json.decode(msgspec.json.encode(report), type=LabReport) == report


def test_what_could_not_come_does_not_count():
    """The receiver was off from 3 s to 6 s; two messages came late all the same."""
    sent = numbered(range(10))
    trace = trace_of(sent, [(0.02, payload) for at, payload in sent if at not in (4, 8)])
    pair = result(trace, counts=lambda sample: not 3 <= sample.at < 6)
    assert (pair.sent, pair.received) == (7, 6)
    assert pair.bytes_identical, "what came late was sent, too"
    assert pair.pdr_tenths == [1.0, 1.0, 1.0, None, None, None, 1.0, 1.0, 0.0, 1.0]


def test_hops_are_told_where_robots_relay():
    trace = trace_of(numbered([0.0, 0.1, 5.0]), [])
    trace.received["cmd_vel"] = [
        Sample(INFINITE, b"0", 0.01, hops_left=8),
        Sample(INFINITE, b"1", 0.01, hops_left=7),
        Sample(INFINITE, b"2", 0.01, hops_left=6),
    ]
    assert result(trace).hops == []
    hops = result(trace, hop_limit=8).hops
    assert len(hops) == BINS
    assert (hops[0], hops[20]) == (1.5, 3.0)
    assert set(hops[1:20] + hops[21:]) == {None}


def test_each_class_is_told_over_time():
    clock = Clock(began_at=100.0, duration_s=40.0)
    sent = numbered([100.5, 101.5, 101.6])
    trace = trace_of(sent, [(0.01, b"0"), (0.03, b"2")])
    _, passages = pair_result(1, 2, trace, clock, None, lambda _: True)
    found = classes_over_time([("bulk", passages[0]), ("urgent", passages[0])], clock)
    assert [each.qos for each in found] == ["urgent", "bulk"]
    assert found[0].pdr[:3] == [1.0, 0.5, None]
    assert found[0].p50_ms[:3] == pytest.approx([10.0, 30.0, None])
    assert len(found[0].p99_ms) == BINS
