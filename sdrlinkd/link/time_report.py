"""The link's report: latencies and clocks."""

from sdrlinkd.link.link import Link
from sdrlinkd.link.timesync import State
from sdrlinkd.reports import ClockReport, LatencyReport


def waits_ms(link: Link, topic_id: int) -> dict[str, float]:
    """Why messages of one of our topics waited, by the report's names."""
    waits = link.scheduler.tx_delays.of_topic.get(topic_id)
    if waits is None:
        return {}
    return {
        "queue_ms": 1e3 * waits.queue_s,
        "access_ms": 1e3 * waits.access_s,
        "again_ms": 1e3 * waits.again_s,
    }


def latency_report(link: Link, src: int, topic_id: int) -> LatencyReport:
    """Of a topic heard with STAMPs."""
    latency = link.delivery.latencies[src, topic_id]
    parts, period = latency.parts(), latency.period_ms()
    told = link.waits_records.get((src, topic_id))
    wait_ms = 1e3 * parts.wait_s
    split = {}
    if told is not None and (whole := sum(told[1:])):
        names = ("queue_ms", "access_ms", "again_ms")
        split = {name: wait_ms * share / whole for name, share in zip(names, told[1:], strict=True)}
    return LatencyReport(
        wait_ms=wait_ms,
        reassembly_ms=1e3 * parts.reassembly_s,
        air_ms=1e3 * parts.air_s,
        handover_ms=1e3 * parts.handover_s,
        period_ms=period[0] if period else None,
        jitter_ms=period[1] if period else None,
        percentiles_ms=latency.percentiles_ms(),
        **split,
    )


def clock_report(link: Link, src: int, now: float) -> ClockReport | None:
    """What is known of a robot's clock; None: nothing, or it is our own."""
    peer = link.clocks.peers.get(src)
    if peer is None:
        return None
    state, known, wall = peer.state(now), peer.estimate(now), link.clocks.wall_offset(src, now)
    is_known = known is not None and state is not State.UNSYNCED
    return ClockReport(
        state=state.value,
        offset_ms=1e3 * known.offset(now) if known and is_known else None,
        bound_us=1e6 * known.bound(now) if known and is_known else None,
        skew_ppm=1e6 * known.skew if known and is_known else None,
        wall_offset_ms=1e-6 * wall[0] if wall else None,
        wall_bound_us=1e6 * wall[1] if wall else None,
        period_s=peer.period_s,
        samples=peer.envelope.samples,
        steps=peer.envelope.steps,
        contradicted=peer.envelope.contradicted,
        refused=peer.refused,
        resets=peer.resets,
    )
