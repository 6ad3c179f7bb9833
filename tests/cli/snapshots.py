"""Invented snapshots of daemons: a quiet one, and one with more than a screen can show."""

import msgspec

from sdrlinkd.reports import (
    BusReport,
    ClockReport,
    LatencyReport,
    LineReport,
    LinkReport,
    NeighborReport,
    PduLinkReport,
    ReceivedTopicReport,
    RxReport,
    SecurityReport,
    Snapshot,
    TopicReport,
    TxReport,
    VerdictReport,
)

SNAPSHOT = Snapshot(
    version="0.1.0",
    node=1,
    namespace="robot_1",
    state="running",
    taken_at_unix_ns=0,
    uptime_s=3725.0,
    loop_lag_ms=0.42,
    verdict=VerdictReport(protection="sealed",
        level="DEGRADED",
        reasons=["robot 2 has a different registry", "robot 2 hears us at 3 dB, 4 % lost"],
    ),
    carrier=PduLinkReport(
        kind="direct", state="up", detail="1 Mbit/s, loss 0.1", level_dbfs=-31.25, clipped_pct=0.5,
        lines=[
            LineReport(offset_hz=312e3, level_dbfs=-40, over_noise_db=18.2, cut_pct=0.6),
            LineReport(offset_hz=-9e3, level_dbfs=-50, sweeps=True),
        ],
    ),
    bus=BusReport(
        runtime_dir="/run/sdrlinkd",
        received=130,
        published=100,
        control_requests=3,
        bad_envelope_last="2 frames; an envelope has 3: topic, header, payload",
    ),
    link=LinkReport(
        pdu_size=64,
        security=SecurityReport(mode="seal", kid=0, proven=[2]),
        access="csma: PERSIST 0.05; 7 backoffs",
        airtime_s=12.3456,
        air_sent_pct=12.5,
        air_heard_pct=40.25,
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
                accepted_bytes_per_s=15_000.0, policy_from="file",
                sent=50, sent_bytes=75_000, queued=10,
            ),
            TopicReport(
                topic_id=1, name="/robot_1/odom", type="nav_msgs/msg/Odometry", subscribed=True,
                qos="latency", priority=90, accepted=69, accepted_per_s=29.9,
                accepted_bytes_per_s=21_648.0, sent=60,
                sent_bytes=43_440, queued=2, dropped={"tx_expired": 5}, policy_from="type",
            ),
            TopicReport(
                topic_id=2, name="/imu", type="sensor_msgs/msg/Imu", subscribed=False,
                qos="default", priority=64, policy_from="default",
            ),
        ],
        received=[
            ReceivedTopicReport(
                src=2, topic_id=1, name="/odom", republished_as="/rx_robot_2/odom", delivered=100,
                delivered_per_s=29.5,
                delivered_bytes=72_400, delivered_bytes_per_s=21_358.0,
                dropped={"rx_partial_timeout": 3},
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
                per=75 / 755, per_lately=0.041,
                duplicates=4, hops_left=1, reboots=0, snr_db=17.25, snr_there_db=15.5,
                per_there=0.02, mcs=3,
                registry="differs",
            ),
        ],
    ),
    notices=["robot 2 has a different registry: topic id 2 (ours: imu)"],
)  # fmt: skip

LONG = "front_left_stereo_camera_2/image_rect_color/compressed_depth"


def busy(at: int = 0) -> Snapshot:
    """15 topics out, 8 robots with 3 topics each, drops and notes; moment `at` of a sequence."""
    out = [
        TopicReport(
            topic_id=i, name=f"/robot_1/{LONG if i == 2 else f'topic_{i}'}",
            type="sensor_msgs/msg/CompressedImage", subscribed=i != 14,
            qos=("urgent", "latency", "default", "bulk")[i % 4], priority=i,
            accepted=1000 * (i + 1) + 10 * at,
            accepted_per_s=0.0 if i > 10 else 10.0 + i, accepted_bytes_per_s=1234.5 * i,
            sent=990 * (i + 1) + 10 * at, sent_bytes=10**i, queued=7 if i == 3 else 0,
            dropped={"tx_expired": 10 * i, "tx_throttled": 3} if i % 2 else {},
        )
        for i in range(15)
    ]  # fmt: skip
    heard = [
        ReceivedTopicReport(
            src=src, topic_id=i, name=f"/topic_{i}",
            republished_as=f"/rx_robot_{src}/{LONG if i == 2 else f'topic_{i}'}",
            delivered=123_456 + 29 * at, delivered_per_s=29.5 if i else 0.0,
            delivered_bytes=10**9, delivered_bytes_per_s=2.5e6,
            dropped={"rx_partial_timeout": 100 * src}, pdr=1 - src / 100,
            age_ms_last=1234.5 - 5 * (at % 100), age_ms_p50=12.25 * src, age_ms_p99=250.0,
            latency=LatencyReport(
                wait_ms=20.5, queue_ms=10.25, access_ms=10.0, again_ms=0.25, reassembly_ms=4.5,
                air_ms=src + 0.5, handover_ms=2.25, period_ms=33.3, jitter_ms=123.45,
                percentiles_ms={"50": 12.25, "99": 250.0, "max": 1234.5},
            ),
        )
        for src in range(2, 10)
        for i in range(3)
    ]  # fmt: skip
    robots = [
        NeighborReport(
            src=src, is_self=False, last_heard_s_ago=0.25 * src, pdus_heard=10**6 + 30 * at,
            pdus_lost=1000 * src, per=src / 1000, per_lately=src / 100, duplicates=4, hops_left=1,
            reboots=0, snr_db=30.0 - 2 * src + abs(at % 120 - 60) / 6, snr_there_db=28.0 - 2 * src,
            per_there=src / 50, mcs=src % 8, registry="differs" if src == 5 else "same",
            clock=ClockReport(
                state="synced", offset_ms=-12345.678, bound_us=12.5, skew_ppm=-10.25,
                wall_offset_ms=-12345.678, wall_bound_us=102.5, samples=10,
            ),
        )
        for src in range(2, 10)
    ]  # fmt: skip
    link = msgspec.structs.replace(
        SNAPSHOT.link, topics=out, received=heard, neighbors=robots,
        air_sent_pct=12.5 + abs(at % 80 - 40), air_heard_pct=40.25,
        tx=msgspec.structs.replace(SNAPSHOT.link.tx, queued=7 + at % 60, dropped=DROPPED),
        rx=msgspec.structs.replace(
            SNAPSHOT.link.rx, delivered=100 + 50 * at,
            dropped={"rx_partial_timeout": 3 + at * at // 30},
        ),
    )  # fmt: skip
    reasons = [f"robot {src} hears us at {3 * src} dB, {src} % lost" for src in range(2, 10)]
    return msgspec.structs.replace(
        SNAPSHOT, link=link, uptime_s=SNAPSHOT.uptime_s + at,
        verdict=VerdictReport(protection="sealed", level="DEGRADED", reasons=reasons),
        notices=[f"note number {i}" + ", which goes on for a while" * 4 for i in range(4)],
    )  # fmt: skip


DROPPED = {
    "tx_bad_envelope": 1, "tx_expired": 490, "tx_throttled": 21, "tx_overflow_old": 12_345,
    "tx_too_big": 99, "tx_unknown_topic": 3, "tx_superseded": 44,
}  # fmt: skip
