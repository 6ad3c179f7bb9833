"""Airtime and worst-case latency of periodic topics, by response-time analysis.

A message waits for what is more urgent and for one burst of what is not (Joseph and Pandya 1986,
with blocking): `R = G + B + C + Σ ⌈R / T_j⌉ C_j` over all topics j that go before it, where G is
what a turn is waited for, and all else is served in turns.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from sdrlinkd.link import (
    DEFAULT_POLICY,
    IDLE_SHARE,
    OVERRUN,
    QOS_BY_LABEL,
    SHARED_OVERRUN,
    CarrierTraits,
    ClassesParams,
    Qos,
    Settled,
    TopicPolicy,
    lifespan_of,
)
from sdrlinkd.modem import Airtimes
from sdrlinkd.plan.supply import Supply, supply_of
from sdrlinkd.plan.traffic import LeftOut, Load, after_policy
from sdrlinkd.wire import ENTRY_HEADER_SIZE, STAMP_SIZE, equal_payload, fragment_count

FULL = 0.95
"""More of the air than this cannot be relied on."""
FOREVER = float("inf")
ROUNDS = 5000
RECORDS_S, RECORDS = 1.0, 0.02
"""A PDU of a beacon's records in so long, and of the air for CLOCK and RECEIPT."""
LEVEL = Qos.LATENCY
"""Up to this class robots go before others' lower ones; among those, nobody orders robots."""


class Setting(NamedTuple):
    """What the loads share; times in s.

    `longest_s`: no burst is longer; `host_s`: what the machines at both ends add at most.
    """

    airtimes: Airtimes
    pdu_size: int
    mcs: int
    longest_s: float
    classes: ClassesParams
    robots: int
    settled: Settled
    traits: CarrierTraits
    host_s: float
    notes: tuple[str, ...] = ()
    """What a person should know of how this was planned."""

    @property
    def one_s(self) -> float:
        """A burst of one PDU."""
        return self.airtimes.airtime_s(self.mcs, 1)

    @property
    def each_s(self) -> float:
        """A further PDU in a burst."""
        return self.airtimes.airtime_s(self.mcs, 2) - self.one_s


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
    """Share of what the policy lets pass that all robots together ask for."""
    is_feasible: bool
    advice: list[str]
    robots: int = 1
    policy: str = "none"
    carries: float = 1.0
    """Share of the air that bursts can take with that policy on this radio."""
    notes: list[str] = []  # noqa: RUF012  # never changed
    left_out: list[LeftOut] = []  # noqa: RUF012


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


def make_plan(
    loads: Sequence[Load],
    policies: Mapping[int, TopicPolicy],
    setting: Setting,
    left_out: Sequence[LeftOut] = (),
) -> Plan:
    """For every robot that sends the same."""
    given = ((load, policies.get(load.topic_id, DEFAULT_POLICY)) for load in loads)
    known = [(after_policy(load, policy), policy) for load, policy in given]
    burst_s = min(setting.longest_s, _backlog_s(known, setting))
    supply = supply_of(setting.settled, setting.traits, setting.robots, burst_s, setting.each_s)
    tasks = [_task(load, policy, known, setting, supply) for load, policy in known]
    topics = [
        TopicPlan(
            task.load.name, task.qos.label, task.load.rate_hz, task.load.size, task.pdus,
            task.cost_s / task.period_s, _worst_s(task, tasks, setting, supply),
            lifespan_of(task.policy, task.qos, setting.classes).seconds,
            8e-6 * task.load.rate_hz * task.load.size,
        )
        for task in tasks
    ]  # fmt: skip
    classes = [
        ClassPlan(qos.label, sum(t.air for t in topics if t.qos == qos.label)) for qos in Qos
    ]
    air = sum(topic.air for topic in topics) * (1 + supply.others) / supply.share
    is_in_time = not any(topic.is_late or topic.worst_s == FOREVER for topic in topics)
    fits = air <= FULL and is_in_time
    settled = setting.settled
    return Plan(
        topics, classes, air, fits, [] if fits else _advice(topics, air), setting.robots,
        settled.policy, settled.share, list(setting.notes), list(left_out),
    )  # fmt: skip


def _backlog_s(known: Sequence[tuple[Load, TopicPolicy]], setting: Setting) -> float:
    """A burst of one message of each topic."""
    pdus = sum(_pdus(load.largest, setting.pdu_size, policy.stamp) for load, policy in known)
    return setting.one_s + (pdus - 1) * setting.each_s


def _task(
    load: Load, policy: TopicPolicy, known: Sequence[tuple[Load, TopicPolicy]], setting: Setting,
    supply: Supply,
) -> _Task:  # fmt: skip
    qos = QOS_BY_LABEL[policy.qos]
    one_s, each_s = setting.one_s, setting.each_s
    # What is foreseen cuts bulk into bursts.
    beats = sum(other.rate_hz for other, how in known if QOS_BY_LABEL[how.qos] < qos)
    most = max(1, setting.airtimes.most_pdus(setting.mcs, setting.longest_s))
    gap_s = setting.traits.gap_s
    if beats:
        busy_s = one_s + gap_s
        most = max(1, min(most, round((1 / beats - busy_s) / each_s)))
    overhead_s = one_s - each_s + gap_s + supply.pause_s[qos]
    pdus = _pdus(load.size, setting.pdu_size, policy.stamp)
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
    return n + (stamp and rest + STAMP_SIZE + ENTRY_HEADER_SIZE > k)


def _worst_s(task: _Task, tasks: Sequence[_Task], setting: Setting, supply: Supply) -> float:
    each_s = setting.each_s
    lower = [other for other in tasks if other.rank > task.rank]
    before = [other for other in tasks if other.rank <= task.rank and other is not task]
    robots = 1 + supply.others
    beside = _beside(task, lower, supply)
    demand = sum(other.cost_s / other.period_s for other in (task, *before, *beside))
    if demand * robots > supply.share:
        return FOREVER
    # What has begun is not interrupted: a beacon, or a burst of what is less urgent.
    blocked_s = setting.one_s
    if lower:
        blocked_s = min(setting.longest_s, max(other.most_s for other in lower))
        if task.qos < max(other.qos for other in lower):
            # Periodic topics are foreseen: it ends about when they are due, as far as blocks tell.
            blocked_s = (SHARED_OVERRUN if supply.others else OVERRUN) * each_s
            blocked_s += 0.0 if setting.traits.is_lockstep else setting.traits.react_s
            if setting.one_s * sum(1 / t.period_s for t in (task, *before)) > IDLE_SHARE:
                # The air is not kept free for so much.
                blocked_s = setting.one_s
    if supply.others:
        # A burst of another robot has begun.
        blocked_s += min(setting.longest_s, max((t.most_s for t in lower), default=setting.one_s))
    own_s = blocked_s + task.most_s + task.bursts * supply.passed_s
    rest_s = supply.gap_s + setting.traits.react_s + setting.host_s
    worst_s = rest_s + supply.takes(own_s)
    for _ in range(ROUNDS):
        busy_s = sum(
            math.ceil(worst_s / other.period_s) * other.most_s * robots for other in before
        )
        busy_s += (robots * math.ceil(worst_s / task.period_s) - 1) * task.most_s
        # Keeping the air free for them costs what does not fill a PDU.
        idle_s = sum(
            math.ceil(worst_s / other.period_s) * each_s / 2
            for other in before
            if other.qos < task.qos and task.bursts > 1
        )
        turns = task.bursts + sum(
            math.ceil(worst_s / other.period_s) * other.bursts
            for other in before
            if _level(other) == _level(task)
        )
        if _level(task):
            # Records are of class default.
            busy_s += math.ceil(worst_s / RECORDS_S) * setting.one_s + RECORDS * worst_s
        busy_s += _between_s(worst_s, turns, beside, setting, supply)
        idle_s = min(idle_s, IDLE_SHARE * worst_s)
        more_s = rest_s + supply.takes(own_s + busy_s + idle_s)
        if more_s <= worst_s + 1e-9:
            return worst_s
        if more_s > 1000 * task.period_s + 60:
            break
        worst_s = more_s
    return FOREVER


def _level(task: _Task) -> bool:
    """Whether robots that share the air let those of the other level go first."""
    return task.qos > LEVEL


def _beside(task: _Task, lower: Sequence[_Task], supply: Supply) -> list[_Task]:
    """What is less urgent, and of which others send all the same while this waits: in a level,
    robots take turns whatever they have.
    """
    return [other for other in lower if supply.others and _level(other) == _level(task)]


def _between_s(
    worst_s: float, turns: int, beside: Sequence[_Task], setting: Setting, supply: Supply
) -> float:
    """Bursts of those, in so long: one of each robot before each of our turns, or all there are."""
    if not beside:
        return 0.0
    longest_s = min(setting.longest_s, max(other.most_s for other in beside))
    pause_s = max(supply.pause_s[other.qos] for other in beside)
    all_s = sum(math.ceil(worst_s / other.period_s) * other.most_s for other in beside)
    return supply.others * min(turns * (longest_s + pause_s), all_s)


def _advice(topics: Sequence[TopicPlan], air: float) -> list[str]:
    if air > FULL or any(topic.worst_s == FOREVER for topic in topics):
        largest = max(topics, key=lambda topic: topic.air)
        fits_hz = largest.rate_hz * min(FULL / air, FULL)
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
