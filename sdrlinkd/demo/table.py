"""Our figures beside the paper's Table 6."""

from rich.table import Table

from sdrlinkd.demo.report import RunResult

# GRCon 2025, Table 6: /odom, 15 entries a message.
PAPER_TABLE_6 = {
    "ofdm": ("38.0", "1328", "12", "0.01", "228.6"),
    "direct": ("15.0", "452", "452", "1.00", "21767.9"),
}


def table_6(runs: list[RunResult]) -> Table:
    """One row a run, and the paper's row under it."""
    table = Table(title="The paper's Table 6, and this run", title_justify="left")
    table.add_column("Config")
    for column in (
        "Duration s",
        "Sent",
        "Recv",
        "PDR",
        "Goodput B/s",
        "Latency p50 / p99 ms",
        "Path error m",
    ):
        table.add_column(column, justify="right")
    for run in runs:
        latency = run.latency_ms
        table.add_row(
            run.name,
            f"{run.duration_s:.1f}",
            str(run.sent),
            str(run.received),
            f"{run.pdr:.3f}",
            f"{run.goodput_bytes_per_s:.1f}",
            f"{latency['p50']:.2f} / {latency['p99']:.2f}" if latency else "–",
            "–" if run.path_error_m is None else f"{run.path_error_m:.4f}",
            style="bold",
        )
        paper = PAPER_TABLE_6.get(run.name)
        if paper:
            table.add_row(f"{run.name} (paper)", *paper, "Fig. 6", "Fig. 7", style="dim")
    return table


def topic_table(run: RunResult) -> Table:
    """One row a topic."""
    table = Table(title=f"{run.name}: topics of {run.source}", title_justify="left")
    table.add_column("Topic")
    table.add_column("Type")
    for column in ("Sent", "Recv", "PDR"):
        table.add_column(column, justify="right")
    for topic in run.topics:
        table.add_row(
            "/" + topic.name, topic.type, str(topic.sent), str(topic.received), f"{topic.pdr:.3f}"
        )
    return table
