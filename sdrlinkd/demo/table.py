"""Tables of our results, with the paper's Table 6 for comparison."""

from sdrlinkd.demo.report import RunResult, TopicResult
from sdrlinkd.demo.trace import ODOMETRY
from sdrlinkd.tables import NOTHING, FittedTable, figure, words

# GRCon 2025, Table 6: only /odom, with 15 entries per message.
PAPER_TABLE_6 = {
    "ofdm": ("38.0", "1328", "12", "0.01", "228.6"),
    "direct": ("15.0", "452", "452", "1.00", "21767.9"),
}
COLUMNS = (
    words("config"), figure("s", 3), figure("sent"), figure("recv"), figure("PDR"),
    figure("B/s", 2), figure("p50 ms"), figure("p99 ms"), figure("path m", 1),
)  # fmt: skip


def table_6(runs: list[RunResult]) -> FittedTable:
    """The table with a row per run, a row for each of its odometry topics, and the paper's rows."""
    table = FittedTable("The paper's Table 6, and this run", COLUMNS)
    for run in runs:
        table.add(run.name, *_figures(run, run), style="bold")
        for topic in run.topics:
            if topic.type == ODOMETRY:
                table.add(f"  /{topic.name}", *_figures(run, topic))
        paper = PAPER_TABLE_6.get(run.name)
        if paper:
            figures = (*paper, "Fig. 6", "Fig. 6", "Fig. 7")
            table.add("  paper /odom", *figures, style="dim")
    return table


def topic_table(run: RunResult) -> FittedTable:
    """The table of a run, with a row per topic."""
    columns = (words("topic"), words("type", 1), figure("sent"), figure("recv"), figure("PDR"))
    table = FittedTable(f"{run.name}: {run.source} in PDUs of {run.pdu_size} B", columns)
    for topic in run.topics:
        kind = topic.type.replace("/msg/", "/")
        table.add("/" + topic.name, kind, str(topic.sent), str(topic.received), f"{topic.pdr:.3f}")
    return table


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
