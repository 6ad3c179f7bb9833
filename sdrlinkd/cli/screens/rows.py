"""The tables of `status` and `top`: their columns and the order of their rows."""

from collections.abc import Sequence

from rich.text import Text

from sdrlinkd.cli.screens.figures import (
    bytes_rate,
    decibels,
    duration,
    hertz,
    milliseconds,
    percent,
    rate,
)
from sdrlinkd.reports import NeighborReport, ReceivedTopicReport, Snapshot, TopicReport
from sdrlinkd.tables import NOTHING, FittedTable, figure, words

BY_POLICY = ("tx_throttled", "tx_unchanged", "tx_superseded")
"""Reasons of drops that a policy requests."""
LEVEL_STYLES = {"OK": "bold green", "DEGRADED": "bold yellow", "DOWN": "bold red"}


def robots_table(reports: Sequence[NeighborReport], *, rule: bool) -> FittedTable:
    """The table of robots that are heard, and how they hear us, the worst first."""
    table = FittedTable(
        "robots heard" if rule else "",
        (
            words("robot"), figure("heard"), figure("SNR dB"), figure("there"), figure("PER %"),
            figure("there"), figure("MCS", 2), figure("Doppler Hz", 6), figure("PDUs", 4),
            figure("lost", 3), figure("repaired", 7), figure("ever %", 5), figure("twice", 6),
            words("registry", 1, 8),
        ),
        rule=rule,
    )  # fmt: skip
    for each in sorted(reports, key=_worst_robot):
        table.add(
            f"{each.src} (this one)" if each.is_self else str(each.src),
            f"{duration(each.last_heard_s_ago)} ago",
            decibels(each.snr_db),
            decibels(each.snr_there_db),
            percent(each.per_lately),
            percent(each.per_there),
            str(each.mcs),
            hertz(each.doppler_hz),
            str(each.pdus_heard),
            str(each.pdus_lost),
            str(each.pdus_repaired),
            percent(each.per, 2),
            str(each.duplicates),
            Text(each.registry, style="bold red" if each.registry == "differs" else ""),
        )
    return table


def sent_table(reports: Sequence[TopicReport], *, rule: bool) -> FittedTable:
    """The table of outgoing topics, those with the most losses first."""
    table = FittedTable(
        "sent" if rule else "",
        (
            words("topic out", least=18), words("class", 2, 7), words("by", 6, 4),
            figure("prio", 5), figure("Hz"), figure("bytes", 1), figure("in", 4), figure("sent", 3),
            figure("queued"), figure("dropped"),
        ),
        rule=rule,
    )  # fmt: skip
    for each in sorted(reports, key=_worst_sent):
        table.add(
            each.name,
            each.qos,
            each.policy_from,
            str(each.priority),
            rate(each.accepted_per_s),
            bytes_rate(each.accepted_bytes_per_s),
            str(each.accepted),
            str(each.sent),
            str(each.queued),
            str(sum(each.dropped.values())),
            style="" if each.subscribed else "dim",
        )
    return table


def heard_table(reports: Sequence[ReceivedTopicReport], *, rule: bool) -> FittedTable:
    """The table of received topics, those with the most losses first."""
    table = FittedTable(
        "heard" if rule else "",
        (
            words("topic in", least=18), figure("from", 6), figure("Hz"), figure("bytes", 1),
            figure("in", 5), figure("lost"), figure("PDR"), figure("age ms", 3),
            figure("p50", 4), figure("p99 ms"),
        ),
        rule=rule,
    )  # fmt: skip
    for each in sorted(reports, key=_worst_heard):
        table.add(
            each.republished_as or each.name,
            str(each.src),
            rate(each.delivered_per_s),
            bytes_rate(each.delivered_bytes_per_s),
            str(each.delivered),
            str(sum(each.dropped.values())),
            NOTHING if each.pdr is None else f"{each.pdr:.3f}",
            milliseconds(each.age_ms_last),
            milliseconds(each.age_ms_p50),
            milliseconds(each.age_ms_p99),
        )
    return table


def drops(snapshot: Snapshot) -> list[tuple[str, str, int]]:
    """(what, reason, count) for each reason of drops, the most frequent first."""
    link = snapshot.link
    found = [
        *(("message out", *each) for each in link.tx.dropped.items()),
        *(("message in", *each) for each in link.rx.dropped.items()),
        *(("PDU in", *each) for each in link.rx.pdus_dropped.items() if each[0] != "rx_control"),
    ]
    return sorted((each for each in found if each[2]), key=lambda each: -each[2])


def is_idle(topic: TopicReport | ReceivedTopicReport) -> bool:
    """Whether a topic has no recent messages and none in the queue."""
    if isinstance(topic, TopicReport):
        return not (topic.accepted_per_s or topic.queued)
    return not topic.delivered_per_s


def failed(topic: TopicReport) -> int:
    """Number of messages dropped for reasons other than those in BY_POLICY."""
    return sum(count for reason, count in topic.dropped.items() if reason not in BY_POLICY)


def _worst_robot(robot: NeighborReport) -> tuple[object, ...]:
    snr = [each for each in (robot.snr_db, robot.snr_there_db) if each is not None]
    return (
        robot.is_self,
        robot.registry != "differs",
        -max(robot.per_lately or 0.0, robot.per_there or 0.0),
        min(snr, default=100.0),
        -robot.last_heard_s_ago,
        robot.src,
    )


def _worst_sent(topic: TopicReport) -> tuple[object, ...]:
    return (-failed(topic), -topic.queued, -topic.accepted_per_s, topic.topic_id)


def _worst_heard(topic: ReceivedTopicReport) -> tuple[object, ...]:
    pdr = 1.0 if topic.pdr is None else topic.pdr
    return (round(pdr, 3), -topic.delivered_per_s, topic.src, topic.topic_id)
