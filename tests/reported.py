"""Snapshots with just what a test is about."""

from sdrlinkd.reports import (
    BusReport,
    LinkReport,
    NeighborReport,
    PduLinkReport,
    RxReport,
    Snapshot,
    TopicReport,
    TxReport,
)


def topic(number=1, name="/robot_1/odom", kind="nav_msgs/msg/Odometry", qos="default", **more):
    return TopicReport(
        topic_id=number, name=name, type=kind, subscribed=True, qos=qos, priority=64, **more
    )


def neighbor(src, **more):
    told = {
        "is_self": False, "last_heard_s_ago": 0.1, "pdus_heard": 100, "pdus_lost": 0, "per": 0.0,
        "duplicates": 0, "hops_left": 1, "reboots": 0,
    }  # fmt: skip
    return NeighborReport(src=src, **{**told, **more})


def snapshot(node=1, uptime_s=1.0, topics=(), neighbors=(), dropped=None, **link):
    tx = TxReport(
        accepted=0, sent=0, queued=0, queued_bytes=0, in_flight=0, dropped=dropped or {},
        queued_by_class={}, entries=0, pdus_composed=0, pdus_sent=0, pdus_failed=0, bursts_sent=0,
        bursts_failed=0,
    )  # fmt: skip
    rx = RxReport(
        pdus_heard=0, pdus_used=0, pdus_dropped={}, started=0, delivered=0, held=0, held_bytes=0,
        dropped={},
    )  # fmt: skip
    told = {
        "pdu_size": 64, "access": "", "airtime_s": 0.0, "bursts_by_mcs": {}, "bursts_late": 0,
        "mcs_changes": [], "control_channel": True, "registry_digest": "", "tx": tx, "rx": rx,
        "topics": list(topics), "received": [], "neighbors": list(neighbors),
    }  # fmt: skip
    return Snapshot(
        version="1", node=node, namespace=f"robot_{node}", state="running", taken_at_unix_ns=0,
        uptime_s=uptime_s, loop_lag_ms=0.0, carrier=PduLinkReport(kind="direct", state="up"),
        bus=BusReport(runtime_dir="", received=0, published=0, control_requests=0),
        link=LinkReport(**{**told, **link}),
    )  # fmt: skip
