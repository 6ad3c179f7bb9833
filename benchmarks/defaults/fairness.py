"""Random topics of one class on one link: what one below its share waits for, over its bound."""

from collections.abc import Iterator
from random import Random
from typing import NamedTuple

from benchmarks.report import Row
from sdrlinkd.link import (
    HEAD_START,
    AccessParams,
    Link,
    LinkParams,
    Offer,
    Opportunity,
    Outcome,
    PduLinkTraits,
    QueueParams,
    RateParams,
    ReassemblyParams,
    TopicPolicy,
)
from sdrlinkd.wire import Registry, equal_payload

PDU_SIZE, PDU_S, BURST = 220, 0.001, 8
ROOM = equal_payload(PDU_SIZE, 1)
MESSAGES = 5
"""Messages of the topic below its share in each draw."""
AHEAD = HEAD_START + 2
"""PDUs by which each other topic may be ahead of the one that waits."""


class _Topic(NamedTuple):
    size: int
    weight: float
    period_s: float


def fairness_rows(seed: int, draws: int) -> Iterator[Row]:
    """Rows on `draws` random mixes of 2 to 64 topics."""
    ratios = [ratio for i in range(draws) for ratio in _waits_over_bound(Random(1000 * seed + i))]
    note = f"{draws} mixes of 2 to 64 topics of random sizes, rates and weights"
    n = len(ratios)
    yield Row("fair_wait_over_bound", max(ratios), "", 1, "less", n, note=note)
    yield Row("fair_bounds_broken", sum(each > 1 for each in ratios), "", 0, "less", n, note=note)


def _waits_over_bound(rng: Random) -> list[float]:
    """The waits of one topic below its share beside others above theirs, over the bound."""
    n = rng.randint(2, 64)
    weights = [rng.choice((0.5, 1.0, 1.0, 4.0)) for _ in range(n)]
    share = weights[0] / sum(weights)
    size = rng.choice((20, 150, 400, 1500))
    n_pdus = -(-(size + 20) // (ROOM - 20)) + 1
    topics = [_Topic(size, weights[0], n_pdus * PDU_S / share * rng.uniform(1.0, 1.5))]
    for weight in weights[1:]:
        other = rng.choice((60, 150, 400, 3000, 9000))
        fair_s = other / ROOM * PDU_S * sum(weights) / weight
        topics.append(_Topic(other, weight, fair_s * rng.uniform(0.5, 0.9)))
    bound_s = (BURST + n_pdus / share + AHEAD * (n - 1) + 1) * PDU_S
    return [each / bound_s for each in _waits_s(topics, rng)]


def _waits_s(topics: list[_Topic], rng: Random) -> list[float]:
    """The time from submission until it has left, of each message of the first topic."""
    link = Link(
        LinkParams(pdu_size=PDU_SIZE, beacon_s=0.0), QueueParams(), ReassemblyParams(),
        Registry(()), 1, rng, has_numbers=True,
    )  # fmt: skip
    link.attach(PduLinkTraits(), AccessParams(policy="none"), RateParams())
    ids = []
    for i, topic in enumerate(topics):
        ids.append(link.declare(Offer(f"t{i}", "std_msgs/msg/String")).id)
        link.set_policy(ids[i], TopicPolicy(weight=topic.weight))
    due = [rng.random() * topic.period_s for topic in topics]
    now, came_at, left_at = 0.0, list[float](), dict[int, float]()
    while len(left_at) < MESSAGES:
        for i, topic in enumerate(topics):
            while due[i] <= now:
                number = len(came_at) if i == 0 else 0
                link.submit(ids[i], number.to_bytes(4, "little").ljust(topic.size, b"\0"), due[i])
                if i == 0:
                    came_at.append(due[0])
                due[i] += topic.period_s
        burst = link.next_burst(Opportunity(now, lambda _, n: n * PDU_S, _most_pdus))
        if burst is None:
            now = min(due)
            continue
        now = max(now, burst.start) + len(burst.pdus) * PDU_S
        link.confirm(burst, Outcome.SENT, now)
        for message in (each for carried in burst.carried for each in carried):
            if message.topic_id == ids[0] and message.is_through:
                left_at[int.from_bytes(message.payload[:4], "little")] = now
    return [at - came_at[number] for number, at in left_at.items()]


def _most_pdus(_mcs: int, longest_s: float) -> int:
    return int(min(BURST, longest_s / PDU_S + 1e-6))
