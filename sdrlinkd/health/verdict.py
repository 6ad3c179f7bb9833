"""The verdict on a daemon: OK, DEGRADED or DOWN, with reasons, the worst first."""

from sdrlinkd.health.lately import Lately
from sdrlinkd.health.words import pdu_link_name, percent, span
from sdrlinkd.reports import RATE_WINDOW_S, NeighborReport, PduLinkReport, Snapshot, VerdictReport

SILENT_S = 5.0
"""Time in s after which a robot that is not heard is missed, if its usual gaps are much shorter."""
SILENT_TIMES = 3.0
GONE_S = 600.0
"""Time of silence in s after which a robot is not expected any more."""
LOSSY = 0.03
"""Share of lost PDUs from which a loss is reported."""
AWAY_S = 1.0
OLD_S, OLD_PERIODS = 1.0, 10.0
"""Age in s, and in periods of its topic, above which a message is reported as old."""
CLIPPED_PCT = 0.1
LATE_LOOP_MS = 250.0


def is_away(pdu_link: PduLinkReport) -> bool:
    """Whether the PDU link is down, for longer than a short pause."""
    return pdu_link.state == "down" and pdu_link.since_s >= AWAY_S


def is_silent(robot: NeighborReport) -> bool:
    """Whether a robot that was heard before is missed now."""
    patience_s = max(SILENT_S, SILENT_TIMES * robot.usual_gap_s)
    return robot.last_heard_s_ago > patience_s


def judge(snapshot: Snapshot, lately: Lately, shares_air: bool) -> VerdictReport:
    """The verdict on `snapshot`; `shares_air`: other robots should be heard."""
    down = _down(snapshot)
    if down:
        return VerdictReport(level="DOWN", reasons=[down])
    # Causes come before what they explain.
    reasons = [
        *_machine(snapshot, lately),
        *snapshot.link.security.strangers,
        *_robots(snapshot, shares_air, is_starved=lately.grown(snapshot, "samples_lost") > 0),
        *_air(snapshot, lately),
        *_queue(snapshot, lately),
        *_ages(snapshot),
    ]
    if snapshot.state == "draining":
        reasons.insert(0, "stopping: sends what is queued, accepts nothing more")
    return VerdictReport(level="DEGRADED" if reasons else "OK", reasons=reasons)


def _down(snapshot: Snapshot) -> str:
    pdu_link = snapshot.carrier
    if snapshot.link.security.halted:
        return snapshot.link.security.halted
    name, since = pdu_link_name(pdu_link), span(pdu_link.since_s)
    if pdu_link.state == "opening":
        return f"no {name} yet: {pdu_link.reason}"
    if pdu_link.state == "waiting":
        return f"no {name} since {since}: {pdu_link.reason}"
    if pdu_link.state == "refused":
        return f"the {name} refuses the settings: {pdu_link.reason}"
    if is_away(pdu_link):
        return f"no {name} since {since}" + (f": {pdu_link.reason}" if pdu_link.reason else "")
    if pdu_link.state == "ended":
        return f"the {name} has ended"
    others = any(not each.is_self for each in snapshot.link.neighbors)
    return "" if others else "; ".join(snapshot.link.security.strangers)


def _robots(snapshot: Snapshot, shares_air: bool, *, is_starved: bool) -> list[str]:
    """Reasons that concern the robots that we hear, and how they hear us.

    `is_starved`: samples were dropped, which explains why we hear less.
    """
    robots = [each for each in snapshot.link.neighbors if not each.is_self]
    reasons = []
    if not robots and shares_air:
        return ["no robot heard yet"]
    for robot in robots:
        if is_silent(robot):
            if robot.last_heard_s_ago < GONE_S:
                reasons.append(f"robot {robot.src} not heard for {span(robot.last_heard_s_ago)}")
            continue
        reasons += _quality(robot, is_starved=is_starved)
    if robots and all(each.last_heard_s_ago >= GONE_S for each in robots):
        last_s = min(each.last_heard_s_ago for each in robots)
        reasons.append(f"no robot heard for {span(last_s)}")
    return reasons


def _quality(robot: NeighborReport, *, is_starved: bool) -> list[str]:
    reasons = []
    if robot.registry == "differs":
        reasons.append(f"robot {robot.src} has a different topic registry")
    if robot.per_there is not None and robot.per_there >= LOSSY:
        reasons.append(
            f"robot {robot.src} hears us{_at(robot.snr_there_db)}, {percent(robot.per_there)} lost"
        )
    if robot.per_lately is not None and robot.per_lately >= LOSSY and not is_starved:
        reasons.append(
            f"we hear robot {robot.src}{_at(robot.snr_db)}, {percent(robot.per_lately)} lost"
        )
    return reasons


def _at(snr_db: float | None) -> str:
    return "" if snr_db is None else f" at {snr_db:.0f} dB"


def _air(snapshot: Snapshot, lately: Lately) -> list[str]:
    """Reasons that concern what others send on this channel."""
    reasons = []
    skipped = lately.grown(snapshot, "peaks_skipped")
    if skipped > 0:
        reasons.append(
            f"interference: {skipped} preambles skipped in {RATE_WINDOW_S:g} s, as too many before "
            "them brought no message"
        )
    crowded = lately.grown(snapshot, "windows_not_notched")
    if crowded > 0:
        reasons.append(
            "interference: narrow signals fill more than three eighths of the band, so they are "
            "not cut"
        )
    refused = lately.grown(snapshot, "headers_refused")
    if refused > 0:
        reasons.append(
            f"{refused} headers refused in {RATE_WINDOW_S:g} s: not of this link's PDU length, or "
            "longer than modem.max_burst_s"
        )
    return reasons


def _queue(snapshot: Snapshot, lately: Lately) -> list[str]:
    shed = lately.shed(snapshot)
    if not shed:
        return []
    worst = next(iter(shed))
    others = f" and {len(shed) - 1} other topics" if len(shed) > 1 else ""
    dropped = f"{sum(shed.values())} messages dropped in {RATE_WINDOW_S:g} s"
    return [f"traffic exceeds the channel capacity: {dropped}, most of {worst}{others}"]


def _ages(snapshot: Snapshot) -> list[str]:
    """Reasons that concern topics which wait, here or at their source, the oldest first."""
    waiting = [
        (topic.queue_ms, f"{topic.name} waits {_seconds(topic.queue_ms)} in the queue")
        for topic in snapshot.link.topics
        if topic.queued
        and topic.queue_ms is not None
        and _is_old(topic.queue_ms, topic.accepted_per_s)
    ]
    old = [
        (topic.age_ms_p50, f"{topic.republished_as} is {_seconds(topic.age_ms_p50)} old")
        for topic in snapshot.link.received
        if topic.age_ms_p50 is not None and _is_old(topic.age_ms_p50, topic.delivered_per_s)
    ]
    return [words for _, words in sorted(waiting + old, reverse=True)]


def _is_old(age_ms: float, per_s: float) -> bool:
    """Whether messages that come so often are older than they should be."""
    return per_s > 0 and age_ms > 1e3 * max(OLD_S, OLD_PERIODS / per_s)


def _seconds(ms: float) -> str:
    return f"{ms / 1e3:.1f} s" if ms < 1e4 else span(ms / 1e3)


def _machine(snapshot: Snapshot, lately: Lately) -> list[str]:
    pdu_link, reasons = snapshot.carrier, []
    lost = lately.grown(snapshot, "samples_lost")
    if lost > 0:
        reasons.append(f"the CPU is too slow: {lost} samples dropped in {RATE_WINDOW_S:g} s")
    if pdu_link.clipped_pct >= CLIPPED_PCT:
        reasons.append(
            f"the receiver clips {pdu_link.clipped_pct:.2g} % of the samples: lower its gain"
        )
    if snapshot.loop_lag_ms >= LATE_LOOP_MS:
        reasons.append(f"the event loop lags {snapshot.loop_lag_ms:.0f} ms: the CPU is busy")
    return reasons
