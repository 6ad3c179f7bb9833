"""What would become of the last minute's traffic with another MCS, rate or policy."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any, NamedTuple

import msgspec

from sdrlinkd.config import Config, typed_config
from sdrlinkd.link import QOS_BY_LABEL, TopicPolicy
from sdrlinkd.plan import Load, Plan, TopicPlan, make_plan, setting_of
from sdrlinkd.reports import Snapshot
from sdrlinkd.wire import FIRST_NUMBER

LEAST_S = 2.0
"""Shortest time in s of which traffic is taken."""


class Traffic(NamedTuple):
    """What a robot sent in `span_s` seconds, and how it is sent."""

    node: int
    span_s: float
    loads: list[Load]
    config: Config
    policies: dict[int, TopicPolicy]


@dataclass
class Choice:
    """What is changed; None and absent topics: as it is."""

    mcs: int | None = None
    rate_hz: float | None = None
    robots: int | None = None
    policies: dict[int, dict[str, Any]] = field(default_factory=dict)


class Outcome(NamedTuple):
    """A topic: its plan, and the share of its messages for which there is no air."""

    topic: TopicPlan
    dropped: float


def loads_of(recent: Sequence[Snapshot]) -> tuple[list[Load], float]:
    """(the traffic of a robot's topics, over how many s) from its reports, the oldest first.

    Sizes are means.
    """
    begin = len(recent) - 1
    while begin > 0 and recent[begin - 1].uptime_s < recent[begin].uptime_s:
        begin -= 1
    since_start = recent[max(0, begin) :]
    if not since_start:
        return [], 0.0
    first, last = since_start[0], since_start[-1]
    span_s = last.uptime_s - first.uptime_s
    if span_s < LEAST_S:
        return [], span_s
    before = {each.topic_id: each.accepted for each in first.link.topics}
    loads = []
    for topic in last.link.topics:
        n = topic.accepted - before.get(topic.topic_id, 0)
        rates = [
            (each.accepted_per_s, each.accepted_bytes_per_s)
            for snapshot in since_start
            for each in snapshot.link.topics
            if each.topic_id == topic.topic_id
        ]
        messages, octets = (sum(column) for column in zip(*rates, strict=True))
        if n > 0 and messages > 0:
            size = octets / messages
            loads.append(Load(topic.topic_id, topic.name, n / span_s, size, size))
    return loads, span_s


def traffic_of(
    node: int, loads: list[Load], span_s: float, config: Mapping[str, object],
    policies: Mapping[int, Mapping[str, Any]],
) -> Traffic:  # fmt: skip
    """Traffic, with the configuration and the policies as the daemon tells them.

    Raises ConfigError for a daemon of another version.
    """
    return Traffic(
        node, span_s, loads, typed_config(config),
        {topic_id: policy_of(told) for topic_id, told in policies.items()},
    )  # fmt: skip


def policy_of(told: Mapping[str, Any]) -> TopicPolicy:
    """A policy as the control socket tells it, which writes infinity as a word."""
    return msgspec.convert(
        {key: inf if value == "inf" else value for key, value in told.items()}, TopicPolicy
    )


def foresee(traffic: Traffic, choice: Choice) -> tuple[Plan, list[Outcome]]:
    """The plan of the traffic with a choice. Raises UserError and ConfigError."""
    modem = traffic.config.modem
    modem = msgspec.structs.replace(
        modem,
        mcs=modem.mcs if choice.mcs is None else choice.mcs,
        rate_hz=modem.rate_hz if choice.rate_hz is None else choice.rate_hz,
    )
    config = msgspec.structs.replace(traffic.config, modem=modem)
    has_numbers = any(load.topic_id >= FIRST_NUMBER for load in traffic.loads)
    setting = setting_of(config, traffic.node, choice.robots, has_numbers=has_numbers)
    policies = {
        topic_id: msgspec.structs.replace(policy, **choice.policies.get(topic_id, {}))
        for topic_id, policy in traffic.policies.items()
    }
    plan = make_plan(sorted(traffic.loads), policies, setting)
    return plan, _outcomes(plan, sorted(traffic.loads), policies)


def _outcomes(
    plan: Plan, loads: Sequence[Load], policies: Mapping[int, TopicPolicy]
) -> list[Outcome]:
    """What is carried, in the order in which the scheduler serves topics."""
    whole = sum(topic.air for topic in plan.topics) or 1.0
    room, dropped = 1.0, {}

    def rank(i: int) -> tuple[int, int]:
        policy = policies[loads[i].topic_id]
        return QOS_BY_LABEL[policy.qos], -policy.priority

    for i in sorted(range(len(plan.topics)), key=rank):
        asked = plan.air * plan.topics[i].air / whole
        carried = min(asked, max(0.0, room))
        room -= asked
        dropped[i] = 1 - carried / asked if asked else 0.0
    return [Outcome(topic, dropped[i]) for i, topic in enumerate(plan.topics)]
