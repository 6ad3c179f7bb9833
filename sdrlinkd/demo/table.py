"""Our figures beside the paper's Table 6."""

from rich import box
from rich.table import Table

from sdrlinkd.demo.report import RunResult, TopicResult
from sdrlinkd.demo.trace import ODOMETRY

# GRCon 2025, Table 6: /odom alone, 15 entries a message.
PAPER_TABLE_6 = {
    "ofdm": ("38.0", "1328", "12", "0.01", "228.6"),
    "direct": ("15.0", "452", "452", "1.00", "21767.9"),
}
COLUMNS = ("s", "sent", "recv", "PDR", "B/s", "p50 ms", "p99 ms", "path m")
NOTHING = "–"


def table_6(runs: list[RunResult]) -> Table:
    """A row a run, one for each of its odometry topics, and the paper's."""
    table = _table("The paper's Table 6, and this run")
    table.add_column("config", no_wrap=True)
    for column in COLUMNS:
        table.add_column(column, justify="right", no_wrap=True)
    for run in runs:
        table.add_row(run.name, *_figures(run, run), style="bold")
        for topic in run.topics:
            if topic.type == ODOMETRY:
                table.add_row(f"  /{topic.name}", *_figures(run, topic))
        paper = PAPER_TABLE_6.get(run.name)
        if paper:
            figures = (*paper, "Fig. 6", "Fig. 6", "Fig. 7")
            table.add_row("  paper /odom", *figures, style="dim")
    return table


def topic_table(run: RunResult) -> Table:
    """A row a topic."""
    table = _table(f"{run.name}: {run.source} in PDUs of {run.pdu_size} B")
    table.add_column("topic", no_wrap=True)
    table.add_column("type", no_wrap=True)
    for column in ("sent", "recv", "PDR"):
        table.add_column(column, justify="right", no_wrap=True)
    for topic in run.topics:
        kind = topic.type.replace("/msg/", "/")
        table.add_row(
            "/" + topic.name, kind, str(topic.sent), str(topic.received), f"{topic.pdr:.3f}"
        )
    return table


def _table(title: str) -> Table:
    return Table(
        title=title,
        title_justify="left",
        box=box.SIMPLE_HEAD,
        pad_edge=False,
        collapse_padding=True,
    )


def _figures(run: RunResult, part: RunResult | TopicResult) -> tuple[str, ...]:
    latency = part.latency_ms
    return (
        f"{run.duration_s:.1f}",
        str(part.sent),
        str(part.received),
        f"{part.pdr:.3f}",
        f"{part.goodput_bytes_per_s:.1f}",
        f"{latency['p50']:.2f}" if latency else NOTHING,
        f"{latency['p99']:.2f}" if latency else NOTHING,
        NOTHING if part.path_error_m is None else f"{part.path_error_m:.4f}",
    )
