"""The screen of `plan --team`: the flows that reserve air, their routes, and who has it."""

from collections.abc import Mapping
from math import inf

from rich.console import RenderableType
from rich.text import Text

from sdrlinkd.reports import EVERYONE, AdmissionReport, ReservedFlowReport
from sdrlinkd.tables import NOTHING, FittedTable, figure, words

COLUMNS = (
    words("robot", least=5), words("topic", least=8), words("class", least=7), figure("Hz"),
    figure("bytes", 2), words("to", least=3), words("over", least=4), figure("air"),
    words("word", least=8),
)  # fmt: skip


def team_screen(
    own: int, report: AdmissionReport, worst_s: Mapping[tuple[int, int], float] | None = None
) -> list[RenderableType]:
    """The flows of the team as robot `own` knows them.

    `worst_s` has their worst cases in s by robot and topic id; None: they are not known.
    """
    if not report.flows:
        return [Text("no flow reserves air; a topic does with reserve = true: sdrlinkctl set")]
    columns = COLUMNS if worst_s is None else (*COLUMNS, figure("worst case"))
    table = FittedTable("flows that reserve air", columns)
    for flow in report.flows:
        table.add(
            str(flow.src), flow.name or f"topic {flow.topic_id}", flow.qos, f"{flow.rate_hz:.3g}",
            str(flow.size), "all" if flow.dst == EVERYONE else str(flow.dst),
            ", ".join(map(str, flow.via)) or "direct", f"{flow.air_pct:.1f} %", _word(flow),
            *_worst(flow, worst_s),
            style="bold red" if flow.admitted is False else "",
        )  # fmt: skip
    refused = sum(flow.admitted is False for flow in report.flows)
    said = (
        f"this is robot {own}; robot {report.planner} decides: {report.admitted_pct:.1f} of "
        f"{report.limit_pct:.1f} % of the air are taken"
    )
    if refused:
        said += f"; {refused} of {len(report.flows)} flows refused"
    return [table, Text(said)]


def _worst(flow: ReservedFlowReport, worst_s: Mapping[tuple[int, int], float] | None) -> list[str]:
    """The cell of the worst case, if there is a column for it."""
    if worst_s is None:
        return []
    longest_s = worst_s.get((flow.src, flow.topic_id))
    if longest_s is None:
        return [NOTHING]
    return [f"{1e3 * longest_s:.1f} ms" if longest_s < inf else "unbounded"]


def _word(flow: ReservedFlowReport) -> str:
    if flow.admitted is None:
        return "asks"
    return "admitted" if flow.admitted else "refused"
