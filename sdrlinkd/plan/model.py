"""Computes the airtime and worst-case latency of topics, with advice if they do not fit."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from sdrlinkd.link import (
    DEFAULT_POLICY,
    QOS_BY_LABEL,
    Qos,
    TopicPolicy,
    lifespan_of,
    parity_pdus,
)
from sdrlinkd.plan.advice import slower
from sdrlinkd.plan.air import Setting
from sdrlinkd.plan.bounds import AccessBound
from sdrlinkd.plan.response import FOREVER, Task, Worst, worst_of
from sdrlinkd.plan.supply import Supply, supply_of
from sdrlinkd.plan.traffic import LeftOut, Load, after_policy
from sdrlinkd.wire import (
    ASKING_STAMP_SIZE,
    ENTRY_HEADER_SIZE,
    MAX_FRAGMENTS,
    PART_HEADER_SIZE,
    PART_PARITY,
    PARTS,
    STAMP_SIZE,
    equal_payload,
    fragment_count,
    overhead,
    part_size,
)

FULL = 0.95
"""Largest share of airtime that a plan may use."""


class TopicPlan(NamedTuple):
    """A topic in the plan: its share of airtime, PDUs per message, and worst-case latency."""

    name: str
    qos: str
    rate_hz: float
    size: float
    pdus: int
    air: float
    worst: Worst
    lifespan_s: float
    rate_mbps: float

    @property
    def worst_s(self) -> float:
        """Worst-case latency in s; infinity: unbounded."""
        return self.worst.whole_s

    @property
    def is_late(self) -> bool:
        """Whether messages can exceed their lifespan before they arrive."""
        return self.worst_s > self.lifespan_s


class ClassPlan(NamedTuple):
    """A class in the plan: the share of airtime of all its topics."""

    qos: str
    air: float


class Plan(NamedTuple):
    """A plan; `advice` says what to change if it is not feasible."""

    topics: list[TopicPlan]
    classes: list[ClassPlan]
    air: float
    """Airtime that all robots together need, as a share of what the access policy leaves them."""
    is_feasible: bool
    advice: list[str]
    robots: int = 1
    policy: str = "none"
    carries: float = 1.0
    """Share of airtime that bursts can use with the access policy on this radio."""
    notes: list[str] = []  # noqa: RUF012  # never changed
    left_out: list[LeftOut] = []  # noqa: RUF012
    bounds: list[AccessBound] = []  # noqa: RUF012
    """The longest waits for the air, by number of robots and class."""


def make_plan(
    loads: Sequence[Load],
    policies: Mapping[int, TopicPolicy],
    setting: Setting,
    left_out: Sequence[LeftOut] = (),
) -> Plan:
    """The plan if every robot sends the same `loads` under these policies."""
    given = ((load, policies.get(load.topic_id, DEFAULT_POLICY)) for load in loads)
    known = [(after_policy(load, policy), policy) for load, policy in given]
    topics, asked = _judged(known, setting)
    classes = [
        ClassPlan(qos.label, sum(t.air for t in topics if t.qos == qos.label)) for qos in Qos
    ]
    is_carried = _is_carried(topics, asked, setting)

    def carries(changed: Sequence[Load]) -> bool:
        pairs = zip(changed, known, strict=True)
        judged = _judged([(load, policy) for load, (_, policy) in pairs], setting)
        return _is_carried(*judged, setting)

    advice = _late(topics) if is_carried else [slower([each for each, _ in known], asked, carries)]
    settled = setting.settled
    return Plan(
        topics, classes, sum(asked), not advice, advice, setting.robots, settled.policy,
        settled.share, list(setting.notes), list(left_out), list(setting.bounds),
    )  # fmt: skip


def _judged(
    known: Sequence[tuple[Load, TopicPolicy]], setting: Setting
) -> tuple[list[TopicPlan], list[float]]:
    """(topics, airtime of all robots for each as a share of what the access policy leaves them)."""
    burst_s = min(setting.longest_s, _backlog_s(known, setting))
    supply = supply_of(setting.settled, setting.traits, setting.robots, burst_s, setting.each_s)
    tasks = [_task(load, policy, known, setting, supply) for load, policy in known]
    topics = [
        TopicPlan(
            task.load.name, task.qos.label, task.load.rate_hz, task.load.size, task.pdus,
            task.cost_s / task.period_s, worst_of(task, tasks, setting, supply),
            lifespan_of(task.policy, task.qos, setting.classes).seconds,
            8e-6 * task.load.rate_hz * task.load.size,
        )
        for task in tasks
    ]  # fmt: skip
    return topics, [topic.air * (1 + supply.others) / supply.share for topic in topics]


def _is_carried(topics: Sequence[TopicPlan], asked: Sequence[float], setting: Setting) -> bool:
    full = min(FULL, 1 - setting.repeats)
    return sum(asked) <= full and not any(topic.worst_s == FOREVER for topic in topics)


def _backlog_s(known: Sequence[tuple[Load, TopicPolicy]], setting: Setting) -> float:
    """Airtime in s of one message of each topic, in one burst."""
    pdus = sum(_pdus(load, load.largest, policy, setting) for load, policy in known)
    return setting.one_s + (pdus - 1) * setting.each_s


def _task(
    load: Load, policy: TopicPolicy, known: Sequence[tuple[Load, TopicPolicy]], setting: Setting,
    supply: Supply,
) -> Task:  # fmt: skip
    qos = QOS_BY_LABEL[policy.qos]
    one_s, each_s = setting.one_s, setting.each_s
    # Predictable urgent messages cut bulk messages into several bursts.
    beats = sum(other.rate_hz for other, how in known if QOS_BY_LABEL[how.qos] < qos)
    most = max(1, setting.airtimes.most_pdus(setting.mcs, setting.longest_s))
    gap_s = setting.traits.gap_s
    if beats:
        busy_s = one_s + gap_s
        most = max(1, min(most, round((1 / beats - busy_s) / each_s)))
    overhead_s = one_s - each_s + gap_s + supply.pause_s[qos]
    pdus = _pdus(load, load.size, policy, setting)
    at_most = _pdus(load, load.largest, policy, setting)
    cost_s, most_s = (n * each_s + math.ceil(n / most) * overhead_s for n in (pdus, at_most))
    rank = (qos, -policy.priority)
    bursts = math.ceil(at_most / most)
    return Task(load, policy, qos, rank, 1 / load.rate_hz, pdus, cost_s, most_s, bursts)


def _pdus(load: Load, size: float, policy: TopicPolicy, setting: Setting) -> int:
    """Number of PDUs of a message that does not share them."""
    share = setting.classes.of(QOS_BY_LABEL[policy.qos]).parity
    room = equal_payload(setting.pdu_size, 1)
    k = room - overhead(load.topic_id)
    whole = max(1, math.ceil(size))
    if setting.has_numbers and whole > MAX_FRAGMENTS * k:
        k, share = room - overhead(PARTS), max(share, PART_PARITY)
        n_parts = math.ceil(whole / part_size(setting.pdu_size, share))
        total = fragment_count(math.ceil(whole / n_parts) + PART_HEADER_SIZE, k)
        return n_parts * (total + parity_pdus(k, total, share, room - ASKING_STAMP_SIZE)) + 1
    n = fragment_count(whole, k)
    rest = whole - (n - 1) * k
    parity = parity_pdus(k, n, share, room - ASKING_STAMP_SIZE)
    return n + (policy.stamp and rest + STAMP_SIZE + ENTRY_HEADER_SIZE > k) + parity


def _late(topics: Sequence[TopicPlan]) -> list[str]:
    return [
        f"{topic.name} can take {1e3 * topic.worst_s:.0f} ms but expires after "
        f"{1e3 * topic.lifespan_s:.0f} ms: raise its class or priority, or its lifespan_s"
        for topic in topics
        if topic.is_late
    ]
