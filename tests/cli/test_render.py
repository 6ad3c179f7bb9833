"""The status screen, held against a stored picture of it."""

from io import StringIO
from pathlib import Path

from rich.console import Console

from sdrlinkd.cli import render
from sdrlinkd.cli.status import ledger_lines
from sdrlinkd.reports import (
    BusReport,
    CarrierReport,
    LinkReport,
    NeighborReport,
    ReceivedTopicReport,
    RxReport,
    Snapshot,
    TopicReport,
    TxReport,
)

GOLDEN = Path(__file__).parent / "status.txt"

SNAPSHOT = Snapshot(
    version="0.1.0",
    node=1,
    namespace="robot_1",
    state="running",
    taken_at_unix_ns=0,
    uptime_s=3725.0,
    loop_lag_ms=0.42,
    carrier=CarrierReport(kind="direct", state="up", detail="1 Mbit/s, loss 0.1"),
    bus=BusReport(
        runtime_dir="/run/sdrlinkd",
        received=130,
        published=100,
        control_requests=3,
        bad_envelope_last="2 frames; an envelope has 3: topic, header, payload",
    ),
    link=LinkReport(
        pdu_size=64,
        access="csma: PERSIST 0.05; 7 backoffs",
        airtime_s=12.3456,
        bursts_by_mcs={1: 50, 3: 10},
        bursts_late=2,
        mcs_changes=[(3.5, 2, 3)],
        control_channel=True,
        registry_digest="8c29071360508ee6",
        receipts_untold=4,
        receipts_unasked=1,
        tx=TxReport(
            accepted=130, sent=110, queued=12, queued_bytes=18_000, in_flight=2,
            dropped={"tx_bad_envelope": 1, "tx_expired": 5},
            queued_by_class={"urgent": 0, "latency": 2, "default": 0, "bulk": 10},
            entries=900, pdus_composed=850, pdus_sent=840, pdus_failed=0, bursts_sent=60,
            bursts_failed=0,
        ),
        rx=RxReport(
            pdus_heard=800, pdus_used=780, pdus_dropped={"rx_control": 15, "rx_crc": 5},
            started=104, delivered=100, held=1, held_bytes=900, dropped={"rx_partial_timeout": 3},
        ),
        topics=[
            TopicReport(
                topic_id=0, name="/robot_1/scan", type="sensor_msgs/msg/LaserScan",
                subscribed=True, qos="bulk", priority=64, accepted=60, accepted_per_s=10.0,
                sent=50, sent_bytes=75_000, queued=10,
            ),
            TopicReport(
                topic_id=1, name="/robot_1/odom", type="nav_msgs/msg/Odometry", subscribed=True,
                qos="latency", priority=90, accepted=69, accepted_per_s=29.9, sent=60,
                sent_bytes=43_440, queued=2, dropped={"tx_expired": 5},
            ),
            TopicReport(
                topic_id=2, name="/imu", type="sensor_msgs/msg/Imu", subscribed=False,
                qos="default", priority=64,
            ),
        ],
        received=[
            ReceivedTopicReport(
                src=2, topic_id=1, name="/odom", republished_as="/rx_robot_2/odom", delivered=100,
                delivered_per_s=29.5, delivered_bytes=72_400, dropped={"rx_partial_timeout": 3},
                pdr=100 / 103, age_ms_last=12.345, age_ms_p50=9.876, age_ms_p99=250.0,
            ),
        ],
        neighbors=[
            NeighborReport(
                src=1, is_self=True, last_heard_s_ago=0.2, pdus_heard=100, pdus_lost=0, per=0.0,
                duplicates=0, hops_left=1, reboots=0, registry="same",
            ),
            NeighborReport(
                src=2, is_self=False, last_heard_s_ago=75.0, pdus_heard=680, pdus_lost=75,
                per=75 / 755, duplicates=4, hops_left=1, reboots=0, snr_db=17.25, snr_there_db=15.5,
                per_there=0.02, mcs=3,
                registry="differs",
            ),
        ],
    ),
    notices=["robot 2 has another registry, differing in topic id 2 (ours: imu)"],
)  # fmt: skip


def drawn(renderable):
    console = Console(file=StringIO(), width=110, legacy_windows=False)
    console.print(renderable)
    return "".join(line.rstrip() + "\n" for line in console.file.getvalue().splitlines())


def test_the_screen_is_the_stored_one():
    assert drawn(render.status(SNAPSHOT)) == GOLDEN.read_text()


def test_the_ledger_in_words():
    assert ledger_lines(SNAPSHOT.link) == [
        "messages out: 130 = 110 sent + 12 queued + 2 in flight + 1 tx_bad_envelope + 5 tx_expired",
        "PDUs heard: 800 = 780 used + 15 rx_control + 5 rx_crc",
        "messages in: 104 = 100 delivered + 1 held + 3 rx_partial_timeout",
    ]
