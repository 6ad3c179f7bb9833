"""Reports and explains which flows of the team have air, and which have not."""

from collections.abc import Callable

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.schedule import TeamAir
from sdrlinkd.reports import AdmissionReport, ReservedFlowReport

MOST_NAMED = 5
"""Most flows that a sentence names."""


def admission_report(air: TeamAir, named: Callable[[int, int], str]) -> AdmissionReport:
    """The report on all flows of the team; `named` gives the name of a robot's topic."""
    flows = [
        ReservedFlowReport(
            src=src, topic_id=flow.topic, name=named(src, flow.topic), via=via, dst=flow.dst,
            qos=Qos(flow.qos).label, priority=flow.priority, rate_hz=1e6 / flow.period_us,
            size=flow.size, air_pct=round(100 * share, 3), admitted=is_admitted,
        )
        for src, flow, share, via, is_admitted in air.flows()
    ]  # fmt: skip
    if not flows:
        return AdmissionReport(records_ignored=air.ignored)
    return AdmissionReport(
        planner=air.planner,
        limit_pct=round(100 * air.limit, 3),
        admitted_pct=round(sum(each.air_pct for each in flows if each.admitted), 3),
        flows=flows,
        records_ignored=air.ignored,
    )


def reserved_words(own_id: int, topic_id: int, report: AdmissionReport) -> list[str]:
    """A sentence on the air that one of our topics reserves, if it does."""
    for flow in report.flows:
        if (flow.src, flow.topic_id) != (own_id, topic_id):
            continue
        needs = f"{flow.air_pct:.3g} % of the air over its route"
        if flow.via:
            needs += f" by robot {', '.join(map(str, flow.via))}"
        if flow.admitted is None:
            return [f"asks the team for {needs}; robot {report.planner} has not answered yet"]
        if flow.admitted:
            return [f"admitted by robot {report.planner}: has {needs}"]
        return [f"refused by robot {report.planner}: it needs {needs}; {_taken(report)}"]
    return []


def refused_notices(own_id: int, report: AdmissionReport) -> list[str]:
    """A sentence for each of our topics that the team has no air for."""
    return [
        f"{flow.name}: class {flow.qos}, not admitted: it needs {flow.air_pct:.3g} % of the air, "
        f"and {report.admitted_pct:.3g} of {report.limit_pct:.3g} % are taken; its messages are "
        "dropped: sdrlinkctl plan --team"
        for flow in report.flows
        if flow.src == own_id and flow.admitted is False
    ]


def _taken(report: AdmissionReport) -> str:
    """Who has the air, in words."""
    having = sorted(
        (each for each in report.flows if each.admitted), key=lambda each: -each.air_pct
    )
    named = [
        f"{each.name or f'topic {each.topic_id}'} of robot {each.src} ({each.qos}, "
        f"{each.air_pct:.3g} %)"
        for each in having[:MOST_NAMED]
    ]
    more = len(having) - len(named)
    words = f"{report.admitted_pct:.3g} of {report.limit_pct:.3g} % are taken"
    if named:
        words += f", by {', '.join(named)}" + (f" and {more} more" if more else "")
    return words
