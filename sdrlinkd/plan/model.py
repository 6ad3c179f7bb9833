"""Airtime and worst-case latency of periodic topics, by response-time analysis.

A message waits for what is more urgent and for one burst of what is not (Joseph and Pandya 1986,
with blocking): `R = B + C + Σ ⌈R / T_j⌉ C_j` over all topics j that go before it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from sdrlinkd.link import (
    DEFAULT_POLICY,
    OVERRUN,
    QOS_BY_LABEL,
    SHARED_OVERRUN,
    ClassesParams,
    Qos,
    TopicPolicy,
    lifespan_of,
)
from sdrlinkd.modem import Airtimes
from sdrlinkd.plan.traffic import Load, after_policy
from sdrlinkd.wire import ENTRY_HEADER_SIZE, STAMP_SIZE, equal_payload, fragment_count

FULL = 0.95
"""More of the air than this cannot be relied on."""
FOREVER = float("inf")
ROUNDS = 200


class Setting(NamedTuple):
    """What the loads share; times in s.

    `pause_s`: what a burst waits for its turn on a shared air, by class; `share`: of the time a
    robot may send at all (tdma).
    """

    airtimes: Airtimes
    pdu_size: int
    mcs: int
    longest_s: float
    classes: ClassesParams
    nodes: int
    policy: str
    gap_s: float
    react_s: float
    pause_s: Mapping[Qos, float]
    share: float = 1.0
    turn_s: float = 0.0
    """Until a robot's turn comes again."""


class TopicPlan(NamedTuple):
    """One topic: share of the air, PDUs a message, latency at worst and what bounds it."""

    name: str
    qos: str
    rate_hz: float
    size: float
    pdus: int
    air: float
    worst_s: float
    lifespan_s: float
    rate_mbps: float

    @property
    def is_late(self) -> bool:
        """Whether messages can be worthless before they arrive."""
        return self.worst_s > self.lifespan_s


class ClassPlan(NamedTuple):
    """One class, all topics of it."""

    qos: str
    air: float


class Plan(NamedTuple):
    """What is to be expected; `advice`: what to change where it is not feasible."""

    topics: list[TopicPlan]
    classes: list[ClassPlan]
    air: float
    """Share of the air of all robots together."""
    is_feasible: bool
    advice: list[str]


class _Task(NamedTuple):
    """A topic as the analysis sees it: a message takes `cost_s` on the air, every `period_s`.

    The largest takes `most_s`, in so many bursts.
    """

    load: Load
    policy: TopicPolicy
    qos: Qos
    rank: tuple[int, int]
    period_s: float
    pdus: int
    cost_s: float
    most_s: float
    bursts: int


def make_plan(loads: Sequence[Load], policies: Mapping[int, TopicPolicy], setting: Setting) -> Plan:
    """For every robot that sends the same."""
    given = ((load, policies.get(load.topic_id, DEFAULT_POLICY)) for load in loads)
    known = [(after_policy(load, policy), policy) for load, policy in given]
    tasks = [_task(load, policy, known, setting) for load, policy in known]
    topics = [
        TopicPlan(
            task.load.name, task.qos.label, task.load.rate_hz, task.load.size, task.pdus,
            task.cost_s / task.period_s, _worst_s(task, tasks, setting),
            lifespan_of(task.policy, task.qos, setting.classes).seconds,
            8e-6 * task.load.rate_hz * task.load.size,
        )
        for task in tasks
    ]  # fmt: skip
    classes = [
        ClassPlan(qos.label, sum(t.air for t in topics if t.qos == qos.label)) for qos in Qos
    ]
    air = setting.nodes * sum(topic.air for topic in topics) / setting.share
    if setting.policy == "tdma":
        air = sum(topic.air for topic in topics) / setting.share
    fits = air <= FULL and not any(topic.is_late for topic in topics)
    return Plan(topics, classes, air, fits, [] if fits else _advice(topics, air))


def _task(
    load: Load, policy: TopicPolicy, known: Sequence[tuple[Load, TopicPolicy]], setting: Setting
) -> _Task:
    qos = QOS_BY_LABEL[policy.qos]
    airtimes, mcs = setting.airtimes, setting.mcs
    one_s = airtimes.airtime_s(mcs, 1)
    each_s = airtimes.airtime_s(mcs, 2) - one_s
    pdus = _pdus(load.size, setting.pdu_size, policy.stamp)
    # What is foreseen cuts bulk into bursts.
    beats = sum(other.rate_hz for other, how in known if QOS_BY_LABEL[how.qos] < qos)
    most = max(1, airtimes.most_pdus(mcs, setting.longest_s))
    if beats:
        busy_s = one_s + setting.gap_s
        most = max(1, min(most, round((1 / beats - busy_s) / each_s)))
    overhead_s = one_s - each_s + setting.gap_s + setting.pause_s[qos]
    at_most = _pdus(load.largest, setting.pdu_size, policy.stamp)
    cost_s, most_s = (n * each_s + math.ceil(n / most) * overhead_s for n in (pdus, at_most))
    rank = (qos, -policy.priority)
    bursts = math.ceil(at_most / most)
    return _Task(load, policy, qos, rank, 1 / load.rate_hz, pdus, cost_s, most_s, bursts)


def _pdus(size: float, pdu_size: int, stamp: bool) -> int:
    """PDUs of a message that has them to itself."""
    k = equal_payload(pdu_size, 1)
    whole = max(1, math.ceil(size))
    n = fragment_count(whole, k)
    rest = whole - (n - 1) * k
    return n + (stamp and rest + STAMP_SIZE + ENTRY_HEADER_SIZE > k and n > 1)


def _worst_s(task: _Task, tasks: Sequence[_Task], setting: Setting) -> float:
    airtimes, mcs = setting.airtimes, setting.mcs
    one_s = airtimes.airtime_s(mcs, 1)
    each_s = airtimes.airtime_s(mcs, 2) - one_s
    is_shared = setting.policy in ("csma", "minislot")
    lower = [other for other in tasks if other.rank > task.rank]
    before = [other for other in tasks if other.rank <= task.rank and other is not task]
    # Periodic topics are foreseen: what is less urgent ends about when they are due.
    blocked_s = 0.0
    if lower:
        overrun = SHARED_OVERRUN if is_shared else OVERRUN
        foreseen = task.qos < max(other.qos for other in lower)
        blocked_s = overrun * each_s if foreseen else one_s
    demand = sum(other.cost_s / other.period_s for other in (task, *before))
    if demand * (setting.nodes if is_shared else 1) > setting.share:
        return FOREVER
    others = 0
    if is_shared and setting.nodes > 1:
        others = setting.nodes - 1
        blocked_s += setting.longest_s if lower else one_s
    fixed_s = blocked_s + task.most_s / setting.share + setting.react_s + setting.turn_s
    worst_s = fixed_s
    for _ in range(ROUNDS):
        busy_s = (
            sum(
                math.ceil(worst_s / other.period_s) * other.most_s * (1 + others)
                for other in before
            )
            + others * math.ceil(worst_s / task.period_s) * task.most_s
        )
        # Keeping the air free for them costs what does not fill a PDU.
        idle_s = sum(
            math.ceil(worst_s / other.period_s) * each_s / 2
            for other in before
            if other.qos < task.qos and task.bursts > 1
        )
        more_s = fixed_s + (busy_s + idle_s) / setting.share
        if more_s <= worst_s + 1e-9:
            return worst_s
        if more_s > 1000 * task.period_s + 60:
            break
        worst_s = more_s
    return FOREVER


def _advice(topics: Sequence[TopicPlan], air: float) -> list[str]:
    if air > FULL:
        largest = max(topics, key=lambda topic: topic.air)
        fits_hz = largest.rate_hz * FULL / air
        return [
            (
                f"{100 * air:.0f} % of the air is asked for. {largest.name} takes the most, "
                f"{100 * largest.air:.0f} %: send it at {fits_hz:.3g} Hz or less "
                f"(topic.{largest.name}.period_s = {1 / fits_hz:.3g}), make it smaller (compress), "
                "or use a higher MCS or rate"
            )
        ]
    return [
        f"{topic.name} can take {1e3 * topic.worst_s:.0f} ms and is worthless after "
        f"{1e3 * topic.lifespan_s:.0f} ms: raise its class or priority, or its lifespan_s"
        for topic in topics
        if topic.is_late
    ]
