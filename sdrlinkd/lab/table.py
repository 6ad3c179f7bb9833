"""Tables of a run: all robots while it runs, all pairs at its end."""

from rich.console import Group
from rich.progress_bar import ProgressBar
from rich.text import Text

from phy import MCS_TABLE
from sdrlinkd.lab.report import LabReport, PairResult
from sdrlinkd.lab.run import LabState
from sdrlinkd.reports import Snapshot
from sdrlinkd.tables import NOTHING, FittedTable, figure, words

MOST_ROWS = 20


LIVE = (
    figure("robot"), words("state", 3), words("MCS", 4, 9), figure("air %"), figure("out", 1),
    figure("queued"), figure("dropped"), figure("in", 5), figure("PER %"), figure("age ms"),
    words("hears (SNR dB)", 2),
)  # fmt: skip


def live_table(title: str, state: LabState) -> Group:
    """The table of a running experiment, with a row per robot."""
    table = FittedTable(title, LIVE)
    for snapshot in state.snapshots:
        table.add(*_live_row(snapshot, state.now_s))
    line = Text(f" {state.now_s:.1f} of {state.until_s:g} s")
    return Group(table, ProgressBar(total=state.until_s, completed=state.now_s, width=40), line)


def pair_table(report: LabReport) -> FittedTable:
    """The table of a finished run, with a row per direction or, if there are many, per receiver."""
    if len(report.pairs) > MOST_ROWS:
        return _receiver_table(report)
    table = FittedTable(
        f"{report.title or report.scenario}: delivery by pair",
        (
            words("from"), words("to"), figure("sent"), figure("received"), figure("PDR"),
            figure("p50 ms"), figure("p99 ms"), words("PDR in each tenth", 1),
        ),
    )  # fmt: skip
    for pair in report.pairs:
        latency = pair.latency_ms
        table.add(
            str(pair.sender),
            str(pair.receiver),
            str(pair.sent),
            str(pair.received),
            f"{pair.pdr:.4f}",
            f"{latency['p50']:.2f}" if latency else NOTHING,
            f"{latency['p99']:.2f}" if latency else NOTHING,
            _bars(pair),
        )
    return table


def _receiver_table(report: LabReport) -> FittedTable:
    table = FittedTable(
        f"{report.title or report.scenario}: delivery from all others",
        (
            figure("robot"), figure("sent to it", 1), figure("received"), figure("PDR"),
            figure("worst from"), figure("p50 ms", 2), figure("p99 ms"),
        ),
    )  # fmt: skip
    for robot in report.robots:
        pairs = [pair for pair in report.pairs if pair.receiver == robot.id]
        if not pairs:
            continue
        sent, received = (sum(getattr(p, key) for p in pairs) for key in ("sent", "received"))
        worst = min(pairs, key=lambda pair: pair.pdr)
        slowest = [pair.latency_ms for pair in pairs if pair.latency_ms]
        table.add(
            str(robot.id),
            str(sent),
            str(received),
            f"{received / sent:.4f}" if sent else NOTHING,
            f"{worst.sender} ({worst.pdr:.4f})",
            f"{max(each['p50'] for each in slowest):.2f}" if slowest else NOTHING,
            f"{max(each['p99'] for each in slowest):.2f}" if slowest else NOTHING,
        )
    return table


def _bars(pair: PairResult) -> str:
    """The PDR of each tenth as ten small bars."""
    shades = "▁▁▂▃▄▅▆▇█"
    return "".join(
        "·" if share is None else " " if not share else shades[min(8, int(share * 8 + 0.5))]
        for share in pair.pdr_tenths
    )


def _live_row(snapshot: Snapshot, now_s: float) -> tuple[str, ...]:
    link = snapshot.link
    tx, rx = link.tx, link.rx
    ages = [each.age_ms_p50 for each in link.received if each.age_ms_p50 is not None]
    lost = sum(each.pdus_lost for each in link.neighbors)
    heard = sum(each.pdus_heard for each in link.neighbors)
    used = {each.mcs for each in link.neighbors}
    mcs = "/".join(MCS_TABLE[each].name for each in sorted(used)) or NOTHING
    hears = ", ".join(
        f"{each.src} ({each.snr_db:.0f})" for each in link.neighbors if each.snr_db is not None
    )
    return (
        str(snapshot.node),
        snapshot.carrier.state,
        mcs,
        f"{100 * link.airtime_s / now_s:.1f}" if now_s else NOTHING,
        f"{tx.sent}/{tx.accepted}",
        str(tx.queued),
        str(sum(tx.dropped.values())),
        str(rx.delivered),
        f"{100 * lost / (heard + lost):.1f}" if heard + lost else NOTHING,
        f"{sorted(ages)[len(ages) // 2]:.1f}" if ages else NOTHING,
        hears or NOTHING,
    )
