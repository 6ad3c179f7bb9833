"""The verdict on a daemon: OK, DEGRADED or DOWN, with reasons, the worst first."""

from sdrlinkd.health.lately import Lately
from sdrlinkd.health.words import pdu_link_name, percent, span
from sdrlinkd.reports import (
    RATE_WINDOW_S,
    NeighborReport,
    PduLinkReport,
    ReceivedTopicReport,
    Snapshot,
    VerdictReport,
)

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
GOOD_SNR_DB = 15.0
"""SNR in dB from which noise does not explain a loss at the default MCS."""
PROTECTION = {"off": "in the clear", "auth": "authenticated", "seal": "sealed"}
"""Word for each `security.mode`."""
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
    protection = PROTECTION.get(snapshot.link.security.mode, "sealed")
    down = _down(snapshot, lately, shares_air)
    if down:
        return VerdictReport(level="DOWN", protection=protection, reasons=[down])
    # Causes come before what they explain.
    reasons = [
        *_machine(snapshot, lately),
        *snapshot.link.security.strangers,
        *other_links(snapshot, lately),
        *_robots(snapshot, shares_air, is_starved=lately.grown(snapshot, "samples_lost") > 0),
        *_air(snapshot, lately),
        *_queue(snapshot, lately),
        *_ages(snapshot),
    ]
    if snapshot.state == "draining":
        reasons.insert(0, "stopping: sends what is queued, accepts nothing more")
    level = "DEGRADED" if reasons else "OK"
    return VerdictReport(level=level, protection=protection, reasons=reasons)


def _down(snapshot: Snapshot, lately: Lately, shares_air: bool) -> str:
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
    if is_away(pdu_link) and pdu_link.kind != "loopback":
        why = f": {pdu_link.reason}" if pdu_link.reason else ""
        return f"no {name} since {since}{why}" + ("; check its cable" if name == "radio" else "")
    if pdu_link.state == "ended":
        return f"the {name} has ended"
    unlike = [*snapshot.link.security.strangers, *other_links(snapshot, lately)]
    if _is_accompanied(snapshot) or not (shares_air and unlike):
        return ""
    return "; ".join([*_machine(snapshot, lately), *unlike])


def _is_accompanied(snapshot: Snapshot) -> bool:
    """Whether another robot is heard now."""
    return any(not (each.is_self or is_silent(each)) for each in snapshot.link.neighbors)


def other_links(snapshot: Snapshot, lately: Lately) -> list[str]:
    """Robots that are heard, but cannot be received: they have another network or PDU size.

    Another network is another team, as long as we hear robots in ours.
    """
    pdu_link, ours, reasons = snapshot.carrier, snapshot.link.pdu_size, []
    for each in pdu_link.others:
        if each.network == pdu_link.network:
            reasons.append(
                f"a robot is heard, but with another PDU size ({each.pdu_size} B; ours: {ours} B): "
                "set link.pdu_size alike"
            )
        elif not _is_accompanied(snapshot):
            reasons.append(
                f"a robot is heard, but in another network ({each.network}; ours: "
                f"{pdu_link.network}): set modem.network alike if it is of this team"
            )
    if lately.refused(snapshot, "rx_short") > 0 and not _is_accompanied(snapshot):
        reasons.append(
            f"a robot is heard, but with another PDU size (ours: {ours} B): set link.pdu_size alike"
        )
    return reasons


def _robots(snapshot: Snapshot, shares_air: bool, *, is_starved: bool) -> list[str]:
    """Reasons that concern the robots that we hear, and how they hear us.

    `is_starved`: samples were dropped, which explains why we hear less.
    """
    robots = [each for each in snapshot.link.neighbors if not each.is_self]
    reasons = []
    if not robots and shares_air:
        return ["no robot heard yet: compare frequency, rate and grid at both robots, and antennas"]
    if len(robots) > 1 and all(map(is_silent, robots)):
        # That all fall silent at once has one cause, which is here.
        return [_nobody(robots)]
    for robot in robots:
        if is_silent(robot):
            if robot.last_heard_s_ago < GONE_S:
                gone = f"robot {robot.src} not heard for {span(robot.last_heard_s_ago)}"
                reasons.append(f"{gone}: check its power, its antenna and the distance")
            continue
        reasons += _quality(robot, is_starved=is_starved)
    if robots and all(each.last_heard_s_ago >= GONE_S for each in robots):
        reasons.append(_nobody(robots))
    return reasons


def _nobody(robots: list[NeighborReport]) -> str:
    last_s = min(each.last_heard_s_ago for each in robots)
    return f"no robot heard for {span(last_s)}: check antenna, cable and frequency"


def _quality(robot: NeighborReport, *, is_starved: bool) -> list[str]:
    reasons = []
    if robot.registry == "differs":
        reasons.append(
            f"robot {robot.src} has a different topic registry: copy one registry to all robots"
        )
    if robot.per_there is not None and robot.per_there >= LOSSY:
        reasons.append(
            f"robot {robot.src} hears us{_at(robot.snr_there_db)}, {percent(robot.per_there)} lost"
            + _against_losses(robot.snr_there_db, "its CPU")
        )
    if robot.per_lately is not None and robot.per_lately >= LOSSY and not is_starved:
        reasons.append(
            f"we hear robot {robot.src}{_at(robot.snr_db)}, {percent(robot.per_lately)} lost"
            + _against_losses(robot.snr_db, "other senders")
        )
    return reasons


def _against_losses(snr_db: float | None, else_look_at: str) -> str:
    """What to do about losses: more SNR, or a look at what costs PDUs in spite of the SNR."""
    if snr_db is None:
        return ""
    if snr_db < GOOD_SNR_DB:
        return ": raise the TX gain, come closer, or set rate.adapt = true"
    return f": noise does not explain it; look at {else_look_at}"


def _at(snr_db: float | None) -> str:
    return "" if snr_db is None else f" at {snr_db:.0f} dB"


def _air(snapshot: Snapshot, lately: Lately) -> list[str]:
    """Reasons that concern what others send on this channel."""
    reasons = []
    skipped = lately.grown(snapshot, "peaks_skipped")
    if skipped > 0:
        reasons.append(
            f"interference: {skipped} preambles skipped in {RATE_WINDOW_S:g} s, as too many before "
            "them brought no message: change modem.frequency_hz, or modem.network"
        )
    crowded = lately.grown(snapshot, "windows_not_notched")
    if crowded > 0:
        reasons.append(
            "interference: narrow signals fill more than three eighths of the band, so they are "
            "not cut: change modem.frequency_hz"
        )
    refused = lately.grown(snapshot, "headers_refused")
    if refused > 0 and not snapshot.carrier.others:
        reasons.append(
            f"{refused} headers refused in {RATE_WINDOW_S:g} s: bursts longer than "
            "modem.max_burst_s, which should be the same everywhere, or of another PDU size"
        )
    return reasons


def _queue(snapshot: Snapshot, lately: Lately) -> list[str]:
    shed = lately.shed(snapshot)
    if not shed:
        return []
    worst = next(iter(shed))
    others = f" and {len(shed) - 1} other topics" if len(shed) > 1 else ""
    dropped = f"{sum(shed.values())} messages dropped in {RATE_WINDOW_S:g} s"
    told = f"traffic exceeds the channel capacity: {dropped}, most of {worst}{others}"
    return [f"{told}: {_why(worst)}"]


def _ages(snapshot: Snapshot) -> list[str]:
    """Reasons that concern topics which wait, here or at their source, the oldest first."""
    waiting = [
        (
            topic.queue_ms,
            f"{topic.name} waits {_seconds(topic.queue_ms)} in the queue: {_why(topic.name)}",
        )
        for topic in snapshot.link.topics
        if topic.queued
        and topic.queue_ms is not None
        and _is_old(topic.queue_ms, topic.accepted_per_s)
    ]
    old = [
        (topic.age_ms_p50, _old(topic, topic.age_ms_p50))
        for topic in snapshot.link.received
        if topic.age_ms_p50 is not None and _is_old(topic.age_ms_p50, topic.delivered_per_s)
    ]
    return [words for _, words in sorted(waiting + old, reverse=True)]


def _old(topic: ReceivedTopicReport, age_ms: float) -> str:
    told = f"{topic.republished_as} is {_seconds(age_ms)} old"
    return f"{told}: at robot {topic.src}, {_why(topic.name)}"


def _why(name: str) -> str:
    """The command that tells why messages of a topic wait or are lost."""
    return f"sdrlinkctl why {name.rsplit('/', 1)[-1]}"


def _is_old(age_ms: float, per_s: float) -> bool:
    """Whether messages that come so often are older than they should be."""
    return per_s > 0 and age_ms > 1e3 * max(OLD_S, OLD_PERIODS / per_s)


def _seconds(ms: float) -> str:
    return f"{ms / 1e3:.1f} s" if ms < 1e4 else span(ms / 1e3)


def _machine(snapshot: Snapshot, lately: Lately) -> list[str]:
    pdu_link, reasons = snapshot.carrier, []
    lost = lately.grown(snapshot, "samples_lost")
    if is_away(pdu_link):
        # Only a loopback comes here, which has no device that could be missing.
        reasons.append(
            f"the CPU is too slow: no samples since {span(pdu_link.since_s)}; end other programs, "
            "or lower modem.rate_hz"
        )
    elif lost > 0:
        reasons.append(
            f"the CPU is too slow: {lost} samples dropped in {RATE_WINDOW_S:g} s; end other "
            "programs, or lower modem.rate_hz"
        )
    if pdu_link.clipped_pct >= CLIPPED_PCT:
        reasons.append(
            f"the receiver clips {pdu_link.clipped_pct:.2g} % of the samples: lower its gain"
        )
    if snapshot.loop_lag_ms >= LATE_LOOP_MS:
        reasons.append(
            f"the event loop lags {snapshot.loop_lag_ms:.0f} ms: the CPU is busy; end other "
            "programs"
        )
    return reasons
