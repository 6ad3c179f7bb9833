"""The traffic of producers, as given by a person or taken from a recording."""

import math
import re
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

from sdrlinkd.errors import UserError
from sdrlinkd.link import DEFAULT_POLICY, Deflated, PolicyTable, TopicPolicy
from sdrlinkd.units import octets
from sdrlinkd.wire import FIRST_NUMBER, Registry, Topic, is_topic_name

_LOAD = re.compile(r"/?([\w/]+):([0-9.]+)(?:hz)?:([0-9.]+[a-z]*)", re.IGNORECASE)
SAMPLES = 50
"""Number of messages of a recording that are compressed to estimate sizes."""


class Load(NamedTuple):
    """A topic's load: messages per second, and typical and largest size in bytes on the air."""

    topic_id: int
    name: str
    rate_hz: float
    size: float
    largest: float


class LeftOut(NamedTuple):
    """A topic of a recording that is left out of the plan, and why."""

    name: str
    messages: int
    why: str


def with_declared(
    registry: Registry, table: PolicyTable, types: Mapping[str, str]
) -> tuple[Registry, dict[int, TopicPolicy]]:
    """The registry, followed by the topics of `types`, and the policies by topic id.

    For robots whose producers may declare topics. `types` are message types by topic name; empty:
    unknown.
    """
    known = {topic.name for topic in registry.topics}
    names = {each.removeprefix("/"): kind for each, kind in types.items()}
    more = [name for name in names if is_topic_name(name) and name not in known]
    declared = [Topic(FIRST_NUMBER + i, name, names[name]) for i, name in enumerate(more)]
    both = Registry([*registry.topics, *declared])
    return both, {each.id: table.of(each.name, each.type) for each in both.topics}


def names_in(texts: Iterable[str]) -> list[str]:
    """The names in loads written as `scan:50:1KB`."""
    return [found[1] for text in texts if (found := _LOAD.fullmatch(text.replace(" ", "")))]


def parse_load(text: str, registry: Registry) -> Load:
    """A load written as `scan:50:1KB`: topic, messages per second, size. Raises UserError."""
    found = _LOAD.fullmatch(text.replace(" ", ""))
    topic = registry.by_name(found[1]) if found else None
    if found is None or float(found[2]) <= 0:
        raise UserError(
            f"--topic: got {text}; allowed: NAME:RATE:SIZE, such as scan:50:1KB (50 per second, "
            "1 KB each)"
        )
    if topic is None:
        raise UserError(f"--topic: {found[1]}: unknown topic; {registry.suggest(found[1])}")
    size = octets(found[3], "--topic")
    return Load(topic.id, topic.name, float(found[2]), size, size)


def loads_from_bag(
    messages: Iterable[tuple[str, float, bytes]],
    registry: Registry,
    policies: Mapping[int, TopicPolicy],
    taken: Collection[str] = (),
) -> tuple[list[Load], list[LeftOut]]:
    """Loads of a recording, given as (topic, time in s, payload), with the policies' compression.

    `taken` has the registry names of topics that the daemon takes from the bus; empty: all.
    """
    times: dict[int, list[float]] = defaultdict(list)
    sizes: dict[int, list[int]] = defaultdict(list)
    others: Counter[tuple[str, str]] = Counter()
    wanted = {name.removeprefix("/") for name in taken}
    for name, at, payload in messages:
        topic = registry.by_name(name) or registry.by_name(name.rsplit("/", 1)[-1])
        if topic is None:
            others[name, "not in the registry"] += 1
            continue
        if wanted and topic.name not in wanted:
            others[name, "not selected by the key `topics`"] += 1
            continue
        policy = policies.get(topic.id, DEFAULT_POLICY)
        times[topic.id].append(at)
        size = len(payload)
        if policy.compress == "zstd" and len(sizes[topic.id]) < SAMPLES:
            size = len(Deflated(None).shrink(payload) or payload)
        sizes[topic.id].append(size)
    loads = []
    names = {topic.id: topic.name for topic in registry.topics}
    for topic_id, came in sorted(times.items()):
        span = max(came) - min(came)
        shrunk = policies.get(topic_id, DEFAULT_POLICY).compress == "zstd"
        known = sizes[topic_id][:SAMPLES] if shrunk else sizes[topic_id]
        rate = (len(came) - 1) / span if span > 0 else 1.0
        mean = math.fsum(known) / len(known)
        loads.append(Load(topic_id, names[topic_id], rate, mean, max(known)))
    left_out = [LeftOut(name, count, why) for (name, why), count in sorted(others.items())]
    return loads, left_out


def after_policy(load: Load, policy: TopicPolicy) -> Load:
    """The load that remains after throttling and decimation by `policy`."""
    rate_hz = load.rate_hz / policy.decimate
    if policy.period_s:
        rate_hz = min(rate_hz, 1 / policy.period_s)
    return load._replace(rate_hz=rate_hz)
