"""Predicts the worst cases of the flows of a team that reserve air."""

from collections.abc import Iterable, Mapping
from itertools import groupby

from sdrlinkd.link import TopicPolicy
from sdrlinkd.plan.air import Setting
from sdrlinkd.plan.model import make_plan
from sdrlinkd.plan.traffic import Load
from sdrlinkd.reports import ReservedFlowReport

FlowKey = tuple[int, int]
"""(robot, topic id) of a flow."""


def team_worst_s(flows: Iterable[ReservedFlowReport], setting: Setting) -> Mapping[FlowKey, float]:
    """The longest time in s from the source to the last receiver, by flow; infinity: no bound.

    All robots are taken to send what the flow's source sends, and each relay to add as much. Only
    flows that are not refused count.
    """
    found: dict[FlowKey, float] = {}
    sent = sorted((flow for flow in flows if flow.admitted is not False), key=_source)
    for src, of_src in groupby(sent, _source):
        own = list(of_src)
        loads = [Load(f.topic_id, f.name, f.rate_hz, f.size, f.size) for f in own]
        policies = {
            f.topic_id: TopicPolicy(qos=f.qos, priority=f.priority)  # type: ignore[arg-type]
            for f in own
        }
        plan = make_plan(loads, policies, setting)
        for flow, topic in zip(own, plan.topics, strict=True):
            found[src, flow.topic_id] = topic.worst_s * (1 + len(flow.via))
    return found


def _source(flow: ReservedFlowReport) -> int:
    return flow.src
