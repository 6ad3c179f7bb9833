"""Hand-made snapshots of a daemon: everything is well except what is given."""

from msgspec.structs import replace

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


def robot(src=2, **more):
    """A neighbor that was just heard."""
    return NeighborReport(
        **{
            "src": src, "is_self": False, "last_heard_s_ago": 0.1, "pdus_heard": 100,
            "pdus_lost": 0, "per": 0.0, "per_lately": 0.0, "duplicates": 0, "hops_left": 1,
            "reboots": 0, "snr_db": 17.2, "registry": "same", **more,
        }
    )  # fmt: skip


def topic(name="/robot_1/scan", **more):
    """A topic that is being sent."""
    return TopicReport(
        **{
            "topic_id": 0, "name": name, "type": "", "subscribed": True, "qos": "default",
            "priority": 64, **more,
        }
    )  # fmt: skip


def snapshot(at=10.0, carrier=None, robots=None, topics=(), notices=(), **more):
    """A daemon that has run for `at` seconds; `carrier` changes its radio, `more` its link."""
    link = LinkReport(
        pdu_size=1024, access="none", airtime_s=0.0, bursts_by_mcs={}, bursts_late=0,
        mcs_changes=[], control_channel=True, registry_digest="",
        tx=TxReport(
            accepted=0, sent=0, queued=0, queued_bytes=0, in_flight=0, dropped={},
            queued_by_class={}, entries=0, pdus_composed=0, pdus_sent=0, pdus_failed=0,
            bursts_sent=0, bursts_failed=0,
        ),
        rx=RxReport(
            pdus_heard=0, pdus_used=0, pdus_dropped={}, started=0, delivered=0, held=0,
            held_bytes=0, dropped={},
        ),
        topics=list(topics), received=[], neighbors=[robot()] if robots is None else list(robots),
    )  # fmt: skip
    of_daemon = {key: more.pop(key) for key in ("loop_lag_ms", "state") if key in more}
    whole = Snapshot(
        version="1", node=1, namespace="robot_1", state="running", taken_at_unix_ns=0,
        uptime_s=at, loop_lag_ms=0.4,
        carrier=PduLinkReport(kind="soapy", state="up", detail="usrp", since_s=9.0),
        bus=BusReport(runtime_dir="/run", received=0, published=0, control_requests=0),
        link=replace(link, **{key: more.pop(key) for key in ("mcs_lowest",) if key in more}),
        notices=list(notices), **more,
    )  # fmt: skip
    whole = replace(whole, **of_daemon)
    return replace(whole, carrier=replace(whole.carrier, **(carrier or {})))
