"""A snapshot as one screen. Layout only: every number comes from the reports."""

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from sdrlinkd.reports import (
    ClockReport,
    LinkReport,
    NeighborReport,
    ReceivedTopicReport,
    Snapshot,
    TopicReport,
)

NOTHING = "–"


def status(snapshot: Snapshot) -> RenderableType:
    """The whole screen of `sdrlinkctl status`."""
    parts: list[RenderableType] = [
        headline(snapshot),
        queue(snapshot),
        sent_topics(snapshot.link.topics),
    ]
    if snapshot.link.received:
        parts.append(received_topics(snapshot.link.received))
    if snapshot.link.neighbors:
        parts.append(neighbors(snapshot.link.neighbors))
        parts += clocks(snapshot.link.neighbors)
    drops = dropped(snapshot)
    if drops is not None:
        parts.append(drops)
    parts += [Text(f"note: {notice}", style="yellow") for notice in snapshot.notices]
    return Group(*parts)


def headline(snapshot: Snapshot) -> Text:
    """Who, on what, for how long, in what state."""
    carrier, link = snapshot.carrier, snapshot.link
    text = Text()
    text.append(f"robot {snapshot.node}", style="bold")
    text.append(f" ({snapshot.namespace})" if snapshot.namespace else "")
    text.append(f"  {carrier.kind} ")
    text.append(carrier.state, style="green" if carrier.state == "up" else "bold red")
    text.append(f" ({carrier.detail})" if carrier.detail else "")
    text.append(f"  {snapshot.state}, up {duration(snapshot.uptime_s)}")
    text.append(f"  PDUs of {link.pdu_size} B")
    text.append(f"  loop lag {snapshot.loop_lag_ms:.1f} ms")
    return text


def queue(snapshot: Snapshot) -> Text:
    """The transmit ledger in one line, and what waits by class."""
    tx, rx = snapshot.link.tx, snapshot.link.rx
    waiting = ", ".join(f"{count} {name}" for name, count in tx.queued_by_class.items() if count)
    return Text(
        f"out: {tx.accepted} in = {tx.sent} sent + {tx.queued} queued + {tx.in_flight} in flight "
        f"+ {sum(tx.dropped.values())} dropped;  queue: {waiting or 'empty'}"
        f" ({size(tx.queued_bytes)})\n"
        f"in:  {rx.pdus_heard} PDUs heard, {rx.started} messages begun = {rx.delivered} delivered "
        f"+ {rx.held} incomplete + {sum(rx.dropped.values())} lost"
        + _air(snapshot.link)
        + _receipts(snapshot.link)
    )


def _air(link: LinkReport) -> str:
    """How the air is shared; nothing where it is not."""
    if link.access == "none":
        return ""
    late = f"; {link.bursts_late} bursts came too late and went again" if link.bursts_late else ""
    return f"\nair: {link.access}; {link.airtime_s:.2f} s sent{late}"


def _receipts(link: LinkReport) -> str:
    """Those that reached nobody; nothing where there are none."""
    parts = (
        (link.receipts_untold, "to others found no room"),
        (link.receipts_unasked, "came that nothing was known of any more"),
    )
    told = [f"{count} {words}" for count, words in parts if count]
    return f"\nreceipts: {', '.join(told)}" if told else ""


def sent_topics(topics: list[TopicReport]) -> Table:
    """Topics on their way out."""
    table = boxless("sent")
    for column, justify in (
        ("topic", "left"), ("class", "left"), ("prio", "right"), ("rate", "right"),
        ("in", "right"), ("sent", "right"), ("queued", "right"), ("dropped", "right"),
    ):  # fmt: skip
        table.add_column(column, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    for topic in topics:
        table.add_row(
            topic.name,
            topic.qos,
            str(topic.priority),
            f"{topic.accepted_per_s:.1f} Hz" if topic.accepted_per_s else NOTHING,
            str(topic.accepted),
            str(topic.sent),
            str(topic.queued),
            str(sum(topic.dropped.values())),
            style="" if topic.subscribed else "dim",
        )
    return table


def received_topics(topics: list[ReceivedTopicReport]) -> Table:
    """Topics from the air."""
    table = boxless("heard")
    for column, justify in (
        ("topic", "left"), ("from", "right"), ("rate", "right"), ("in", "right"),
        ("lost", "right"), ("PDR", "right"), ("age ms", "right"), ("p50", "right"),
        ("p99", "right"),
    ):  # fmt: skip
        table.add_column(column, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    for topic in topics:
        table.add_row(
            topic.republished_as or topic.name,
            str(topic.src),
            f"{topic.delivered_per_s:.1f} Hz" if topic.delivered_per_s else NOTHING,
            str(topic.delivered),
            str(sum(topic.dropped.values())),
            NOTHING if topic.pdr is None else f"{topic.pdr:.3f}",
            milliseconds(topic.age_ms_last),
            milliseconds(topic.age_ms_p50),
            milliseconds(topic.age_ms_p99),
        )
    return table


def neighbors(reports: list[NeighborReport]) -> Table:
    """Who is heard."""
    table = boxless("robots heard")
    for column, justify in (
        ("robot", "left"), ("heard", "right"), ("PDUs", "right"), ("lost", "right"),
        ("PER", "right"), ("twice", "right"), ("SNR", "right"), ("hears us", "right"),
        ("MCS", "right"), ("registry", "left"),
    ):  # fmt: skip
        table.add_column(column, justify=justify, no_wrap=True)  # type: ignore[arg-type]
    for report in reports:
        table.add_row(
            f"{report.src} (this one)" if report.is_self else str(report.src),
            f"{duration(report.last_heard_s_ago)} ago",
            str(report.pdus_heard),
            str(report.pdus_lost),
            f"{100 * report.per:.2f} %",
            str(report.duplicates),
            NOTHING if report.snr_db is None else f"{report.snr_db:.1f} dB",
            NOTHING if report.snr_there_db is None else f"{report.snr_there_db:.1f} dB",
            str(report.mcs),
            Text(report.registry, style="bold red" if report.registry == "differs" else ""),
        )
    return table


def clocks(reports: list[NeighborReport]) -> list[Text]:
    """How well those of others are known, in a line; nothing where nobody tells."""
    known = [f"{each.src} {clock_state(each.clock)}" for each in reports if each.clock]
    return [Text(f"clocks of robots: {'; '.join(known)}")] if known else []


def clock_state(clock: ClockReport) -> str:
    """How well another robot's clock is known."""
    if clock.wall_bound_us is None or clock.state == "unsynced":
        return clock.state
    return f"{clock.state}, ± {milliseconds(clock.wall_bound_us / 1e3)} ms"


def dropped(snapshot: Snapshot) -> Table | None:
    """Every reason that has a count; None when there is none."""
    link = snapshot.link
    rows = [
        *(("message out", reason, count) for reason, count in link.tx.dropped.items()),
        *(("message in", reason, count) for reason, count in link.rx.dropped.items()),
        *(
            ("PDU in", reason, count)
            for reason, count in link.rx.pdus_dropped.items()
            if reason != "rx_control"
        ),
    ]
    if not rows:
        return None
    table = boxless("dropped")
    table.add_column("what")
    table.add_column("reason")
    table.add_column("count", justify="right")
    for what, reason, count in rows:
        table.add_row(what, reason, str(count))
    if snapshot.bus.bad_envelope_last:
        table.caption = f"last refused by the bus: {snapshot.bus.bad_envelope_last}"
    return table


def milliseconds(value: float | None) -> str:
    """An age in ms."""
    if value is None:
        return NOTHING
    return f"{value:.2f}" if value < 100 else f"{value:.0f}"


def duration(seconds: float) -> str:
    """A time span as people say it."""
    if seconds < 60:
        return f"{seconds:.1f} s"
    if seconds < 3600:
        return f"{int(seconds // 60)} min {int(seconds % 60)} s"
    return f"{int(seconds // 3600)} h {int(seconds % 3600 // 60)} min"


def size(n_bytes: int) -> str:
    """A number of bytes."""
    for unit, scale in (("MB", 10**6), ("kB", 10**3)):
        if n_bytes >= scale:
            return f"{n_bytes / scale:.1f} {unit}"
    return f"{n_bytes} B"


def boxless(title: str) -> Table:
    """A table with a title and as few lines as possible."""
    return Table(
        title=title,
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        collapse_padding=True,
    )
