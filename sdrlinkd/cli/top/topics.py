"""The table of topics of `top`, sent and received, which can be sorted and filtered."""

from collections.abc import Callable
from typing import NamedTuple

from rich.text import Text

from sdrlinkd.cli.screens import bytes_rate, failed, is_idle, milliseconds, rate
from sdrlinkd.reports import ReceivedTopicReport, Snapshot, TopicReport
from sdrlinkd.tables import NOTHING, FittedTable, figure, words


class TopicRow(NamedTuple):
    """A row of the table: an outgoing topic (`source` is None), or another robot's topic."""

    name: str
    source: int | None
    qos: str
    policy_from: str
    per_s: float
    bytes_per_s: float
    messages: int
    queued: int
    lost: int
    """Messages lost; for outgoing topics without drops that a policy requests."""
    pdr: float | None
    age_ms: float | None
    p99_ms: float | None
    idle: bool

    @property
    def key(self) -> str:
        """The row's key, which no other row has."""
        return f"{self.source} {self.name}"


def _worst(row: TopicRow) -> tuple[object, ...]:
    share = row.lost / max(1, row.messages + row.lost)
    return (row.idle, -round(share, 3), -row.queued, -row.per_s, row.name)


ORDERS: dict[str, Callable[[TopicRow], tuple[object, ...]]] = {
    "worst": _worst,
    "name": lambda row: (row.name,),
    "rate": lambda row: (-row.per_s, row.name),
    "bytes": lambda row: (-row.bytes_per_s, row.name),
    "age": lambda row: (-(row.p99_ms or 0.0), row.name),
}
"""Sort orders by name; the first one is the default."""


def topic_rows(snapshot: Snapshot, order: str, wanted: str) -> list[TopicRow]:
    """The rows of topics whose name, class or robot contains `wanted`, sorted by `order`."""
    rows = [
        *(_out(topic) for topic in snapshot.link.topics),
        *(_in(topic) for topic in snapshot.link.received),
    ]
    found = [row for row in rows if wanted in f"{row.name} {row.qos} robot {row.source}"]
    return sorted(found, key=ORDERS[order])


def topics_table(rows: list[TopicRow]) -> FittedTable:
    """The table with these rows of topics."""
    table = FittedTable(
        "",
        (
            words("", least=3), words("topic", least=18), words("class", 4, 7),
            words("by", 7, 4), figure("Hz"), figure("bytes", 3), figure("count", 5),
            figure("queued", 2), figure("lost"),
            figure("PDR"), figure("age ms", 6), figure("p99 ms"),
        ),
    )  # fmt: skip
    for row in rows:
        out = row.source is None
        table.add(
            "out" if out else "in",
            Text(row.name) if not row.idle else Text(row.name, style="dim"),
            row.qos,
            row.policy_from,
            rate(row.per_s),
            bytes_rate(row.bytes_per_s),
            str(row.messages),
            str(row.queued) if out else "",
            str(row.lost),
            "" if out else NOTHING if row.pdr is None else f"{row.pdr:.3f}",
            "" if out else milliseconds(row.age_ms),
            "" if out else milliseconds(row.p99_ms),
        )
    return table


def _out(topic: TopicReport) -> TopicRow:
    return TopicRow(
        topic.name, None, topic.qos, topic.policy_from, topic.accepted_per_s,
        topic.accepted_bytes_per_s, topic.sent, topic.queued, failed(topic),
        None, None, None, is_idle(topic),
    )  # fmt: skip


def _in(topic: ReceivedTopicReport) -> TopicRow:
    return TopicRow(
        topic.republished_as or topic.name, topic.src, "", "", topic.delivered_per_s,
        topic.delivered_bytes_per_s, topic.delivered, 0, sum(topic.dropped.values()), topic.pdr,
        topic.age_ms_last, topic.age_ms_p99, is_idle(topic),
    )  # fmt: skip
