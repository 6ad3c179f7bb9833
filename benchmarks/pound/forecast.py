"""Compares the forecast of `sdrlinkctl plan` with the measured outcome."""

from random import Random

import numpy as np

from backends import GAP
from benchmarks.pound.ours import MAX_BURST_S, MCS, PDU_SIZE, RATE_HZ, Air, Run
from sdrlinkd.config import ModemParams
from sdrlinkd.link import AccessParams, PduLinkTraits, TopicPolicy, settle
from sdrlinkd.modem import Airtimes
from sdrlinkd.plan import Load, Plan, Setting, make_plan

LEARNING = 10
"""Number of messages of a topic until its period is known."""
CDR_OVERHEAD = 8


def plan_of(run: Run, air: Air) -> Plan:
    """The plan for the flows of an experiment on an air of their own."""
    modem = ModemParams(rate_hz=RATE_HZ, mcs=MCS, max_burst_s=MAX_BURST_S)
    flows = [trace.flow for trace in run.traces]
    loads = [
        Load(i, flow.name, 1 / flow.period_s, flow.size + CDR_OVERHEAD, flow.size + CDR_OVERHEAD)
        for i, flow in enumerate(flows)
    ]
    # In lock-step composing takes no time.
    traits = PduLinkTraits(is_lockstep=True, gap_s=GAP / RATE_HZ, react_s=air.block_s)
    settled = settle(AccessParams(policy="none"), 1, traits, air.max_burst_s, Random(0), 0)
    setting = Setting(
        Airtimes(modem, PDU_SIZE), PDU_SIZE, MCS, air.max_burst_s, air.classes, 1, settled, traits,
        host_s=0.0,
    )  # fmt: skip
    policies = {
        i: TopicPolicy(qos=flow.qos)  # type: ignore[arg-type]
        for i, flow in enumerate(flows)
    }
    return make_plan(loads, policies, setting)


def errors_pct(run: Run, air: Air) -> dict[str, float]:
    """Error of each predicted share of the air, and of each worst latency."""
    plan, simulation = plan_of(run, air), run.simulation
    used_s = simulation.stations[1].link.report(simulation.now).airtime_by_class_s
    found = {}
    for topic, trace in zip(plan.topics, run.traces, strict=True):
        seconds = trace.flow.count * trace.flow.period_s
        used = used_s[topic.qos] / seconds
        worst_s = float(np.nanmax((trace.heard_at - trace.sent_at)[LEARNING:]))
        found[f"{topic.name}_air"] = 100 * (topic.air / used - 1)
        found[f"{topic.name}_worst"] = 100 * (topic.worst_s / worst_s - 1)
    return found
