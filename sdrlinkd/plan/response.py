"""Worst-case latency of periodic topics, by response-time analysis.

A message waits for more urgent messages and for one burst of less urgent ones (Joseph and Pandya
1986, with blocking): `R = G + B + C + Σ ⌈R / T_j⌉ C_j` over all topics j served before it. G is the
wait for a turn, B the blocking, C the message's own airtime; all but G is served in turns. If R is
longer than the topic's own period, its next messages are analyzed, too (Lehoczky 1990).

Topics of equal class and priority share the air fairly, so such a topic j takes no more than its
weight allows: `C_j` in all is at most C · w_j / w, and the PDUs by which it may be ahead. That
bounds the latency of a topic below its share whatever the others offer.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from sdrlinkd.link import HEAD_START, IDLE_SHARE, OVERRUN, SHARED_OVERRUN, Qos, TopicPolicy
from sdrlinkd.plan.air import Setting
from sdrlinkd.plan.supply import LEVEL, Supply
from sdrlinkd.plan.traffic import Load

FOREVER = float("inf")
ROUNDS = 5000
MOST_WAITING = 200
"""Most messages of one topic that may wait; with more, the latency counts as unbounded."""
AHEAD = HEAD_START + 2
"""PDUs that a topic may send before another of its rank without having earned them: its head start,
and one PDU of either."""
RECORDS_S, RECORDS = 1.0, 0.02
"""Period in s of one PDU with a beacon's records, and share of airtime for all CLOCKs and RECEIPTs.
"""


class Task(NamedTuple):
    """A topic in the analysis: a message takes `cost_s` of airtime, every `period_s`.

    The largest message takes `most_s`, in `bursts` bursts.
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


class Worst(NamedTuple):
    """The largest age of a message when it is handed over, in s, by its parts.

    `turn_s` is the wait for a turn on the air that was just missed, `queue_s` that for other
    messages, `air_s` the message's own bursts, `rest_s` reception and hosts.
    """

    turn_s: float
    queue_s: float
    air_s: float
    rest_s: float

    @property
    def whole_s(self) -> float:
        """The sum of all parts; infinity: unbounded."""
        return sum(self)


UNBOUNDED = Worst(0.0, FOREVER, 0.0, 0.0)


def worst_of(task: Task, tasks: Sequence[Task], setting: Setting, supply: Supply) -> Worst:
    """The largest age at which a message of `task` is handed over."""
    lower = [other for other in tasks if other.rank > task.rank]
    before = [other for other in tasks if other.rank <= task.rank and other is not task]
    beside = _beside(task, lower, supply)
    own = task.cost_s / task.period_s
    demand = own + sum(other.cost_s / other.period_s for other in beside)
    demand += sum(min(each.cost_s / each.period_s, _ratio(each, task) * own) for each in before)
    if demand * (1 + supply.others) > supply.share:
        return UNBOUNDED
    found_s, done_s = 0.0, 0.0
    # If a message is not done before the next one comes, a later one may have the largest latency.
    for number in range(1, MOST_WAITING):
        rest_s = supply.gap_s + _blocked_s(task, before, lower, setting, supply)
        done_s = _done_s(number, rest_s, task, before, beside, setting, supply)
        found_s = max(found_s, done_s - (number - 1) * task.period_s)
        if done_s <= number * task.period_s or done_s == FOREVER:
            break
    else:
        return UNBOUNDED
    if found_s == FOREVER:
        return UNBOUNDED
    air_s = min(found_s, task.most_s + task.bursts * supply.passed_s)
    turn_s = min(found_s - air_s, supply.gap_s)
    rest_s = setting.traits.react_s + setting.host_s
    return Worst(turn_s, found_s - air_s - turn_s, air_s, rest_s)


def _blocked_s(
    task: Task, before: Sequence[Task], lower: Sequence[Task], setting: Setting, supply: Supply
) -> float:
    """Longest wait in s for a burst that has begun: a beacon, or less urgent messages."""
    blocked_s = setting.one_s
    if lower:
        blocked_s = min(setting.longest_s, max(other.most_s for other in lower))
        if task.qos < max(other.qos for other in lower):
            # Periodic topics are predicted, so the burst ends about when they are due.
            blocked_s = (SHARED_OVERRUN if supply.others else OVERRUN) * setting.each_s
            blocked_s += 0.0 if setting.traits.is_lockstep else setting.traits.react_s
            often = setting.one_s * sum(1 / each.period_s for each in (task, *before)) > IDLE_SHARE
            if often or supply.closed_s:
                # The channel is not kept free for so frequent messages, nor in others' turns.
                blocked_s = setting.one_s
    if supply.others:
        # Another robot may have begun a burst, too.
        blocked_s += min(setting.longest_s, max((t.most_s for t in lower), default=setting.one_s))
    if task.qos > LEVEL and any(other.qos <= LEVEL for other in before):
        blocked_s += supply.gives_way_s
    return blocked_s


def _done_s(
    number: int, rest_s: float, task: Task, before: Sequence[Task], beside: Sequence[Task],
    setting: Setting, supply: Supply,
) -> float:  # fmt: skip
    """Time in s at which `number` messages of a topic, one per period from 0 on, are sent."""
    robots = 1 + supply.others
    own_s = number * (task.most_s + task.bursts * supply.passed_s)
    until_s = rest_s + supply.takes(own_s)
    for _ in range(ROUNDS):
        busy_s = robots * sum(
            min(
                math.ceil(until_s / other.period_s) * other.most_s,
                _ratio(other, task) * own_s + AHEAD * setting.each_s,
            )
            for other in before
        )
        busy_s += supply.others * math.ceil(until_s / task.period_s) * task.most_s
        # Keeping the channel free for them wastes the time that does not fill a PDU.
        idle_s = sum(
            math.ceil(until_s / other.period_s) * setting.each_s / 2
            for other in before
            if other.qos < task.qos and task.bursts > 1
        )
        busy_s += min(idle_s, IDLE_SHARE * until_s)
        turns = number * task.bursts + sum(
            math.ceil(until_s / other.period_s) * other.bursts
            for other in before
            if _level(other) == _level(task)
        )
        if _level(task):
            # Records are of class default.
            busy_s += math.ceil(until_s / RECORDS_S) * setting.one_s
            busy_s += RECORDS * until_s * robots / setting.robots
        busy_s += _between_s(until_s, turns, beside, setting, supply)
        more_s = rest_s + supply.takes(own_s + busy_s)
        if more_s <= until_s + 1e-9:
            return until_s
        if more_s > 1000 * task.period_s + 60:
            break
        until_s = more_s
    return FOREVER


def _ratio(other: Task, task: Task) -> float:
    """How much airtime another topic may take for each second that `task` takes."""
    return other.policy.weight / task.policy.weight if other.rank == task.rank else FOREVER


def _level(task: Task) -> bool:
    """Whether a topic is of the lower level, which all robots serve after the higher one."""
    return task.qos > LEVEL


def _beside(task: Task, lower: Sequence[Task], supply: Supply) -> list[Task]:
    """Less urgent tasks that other robots send while `task` waits.

    Within a level, robots take turns regardless of what they send.
    """
    return [other for other in lower if supply.others and _level(other) == _level(task)]


def _between_s(
    worst_s: float, turns: int, beside: Sequence[Task], setting: Setting, supply: Supply
) -> float:
    """Airtime in s of other robots' tasks `beside`: one burst each per turn of ours, or all."""
    if not beside:
        return 0.0
    longest_s = min(setting.longest_s, max(other.most_s for other in beside))
    pause_s = max(supply.pause_s[other.qos] for other in beside)
    all_s = sum(math.ceil(worst_s / other.period_s) * other.most_s for other in beside)
    return supply.others * min(turns * (longest_s + pause_s), all_s)
