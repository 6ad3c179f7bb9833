"""The flows of this robot that reserve air, and how much air they take."""

from collections.abc import Collection
from math import ceil

from sdrlinkd.link.packing import parity_pdus
from sdrlinkd.link.qos import QOS_BY_LABEL
from sdrlinkd.link.queue import Intake, TopicPolicy
from sdrlinkd.link.schedule import ClassesParams
from sdrlinkd.link.topics import OwnTopics
from sdrlinkd.link.transmit.fit import Fit
from sdrlinkd.wire import (
    ALL_AIR,
    ASKING_STAMP_SIZE,
    ENTRY_HEADER_SIZE,
    FLOW_AIR_UNIT,
    MAX_FRAGMENTS,
    PART_PARITY,
    STAMP_SIZE,
    ReservedFlow,
    fragment_count,
    octet,
)

MOST_TOLD = (1 << 32) - 1


class OwnFlows:
    """Makes flows of the topics whose policies reserve air; `k` is the payload of a PDU."""

    def __init__(self, topics: OwnTopics, intake: Intake, classes: ClassesParams, k: int) -> None:
        self._topics = topics
        self._intake = intake
        self._classes = classes
        self._k = k

    def wanted(self, fit: Fit, heard: Collection[int]) -> list[ReservedFlow]:
        """Our flows, as they are now; `heard` are the robots that we hear."""
        found = []
        for topic in self._topics:
            policy = self._intake.policy(topic.id)
            if reserves(policy):
                dst = self._intake.destination(topic.id)
                found.append(self._flow(octet(topic.id), dst, policy, fit, heard))
        return found

    def _flow(
        self, topic: int, dst: int, policy: TopicPolicy, fit: Fit, heard: Collection[int]
    ) -> ReservedFlow:
        qos, rate = QOS_BY_LABEL[policy.qos], fit.rate
        to = [dst] if dst in heard else heard
        mcs = min((rate.heard_there(each).mcs for each in to), default=rate.lowest)
        n_pdus = fragment_count(policy.max_bytes + STAMP_SIZE + ENTRY_HEADER_SIZE, self._k)
        # Of a message in parts, each part has parity of its own, which comes to about the same.
        parity = max(PART_PARITY * (n_pdus > MAX_FRAGMENTS), self._classes.of(qos).parity)
        total = min(n_pdus, MAX_FRAGMENTS)
        n_parity = parity_pdus(self._k, total, parity, self._k - ASKING_STAMP_SIZE)
        n_pdus += ceil(n_parity * n_pdus / total)
        air = fit.message_s(mcs, n_pdus) / (policy.period_s * FLOW_AIR_UNIT)
        return ReservedFlow(
            topic, dst, qos, policy.priority, min(max(1, ceil(air)), ALL_AIR),
            max(1, round(1e6 * policy.period_s)), min(policy.max_bytes, MOST_TOLD),
        )  # fmt: skip


def reserves(policy: TopicPolicy) -> bool:
    """Whether a policy reserves air."""
    return policy.reserve and policy.period_s > 0 and policy.max_bytes > 0
