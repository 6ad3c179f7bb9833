"""Chooses the topics for a registry, which has room for few."""

import re
from collections.abc import Iterable
from typing import NamedTuple

from sdrlinkd.config import UNBOUNDED_TYPES
from sdrlinkd.errors import RegistryError, UserError
from sdrlinkd.wire import make_registry

MOST_TOPICS = 15
"""Most topics of a registry; the sixteenth id is for control: ages, beacons, receipts."""
RULE = "small types before large ones (images, clouds, maps), then the busiest"

_OWN = re.compile(r"(rosout|parameter_events)|.*(_action/(status|feedback)|transition_event)")
_ROBOT = re.compile(r"/robot_\d+/(?=.)")


class FoundTopic(NamedTuple):
    """A topic with its registry name; `n_messages` is its number in a recording, 0 if unknown."""

    name: str
    type: str
    n_messages: int = 0


class Choice(NamedTuple):
    """The chosen topics, and the topics left out, with the reasons."""

    taken: list[FoundTopic]
    left_out: dict[str, str]


def choose(found: Iterable[FoundTopic], wanted: list[str], source: str) -> Choice:
    """Choose at most MOST_TOPICS of `found`: those `wanted` or, without wishes, by RULE.

    A robot's namespace (`/robot_1/`) is removed from names, as one registry serves all robots.
    Raises UserError that cites `source` if nothing is left or a wanted topic is missing.
    """
    merged: dict[str, FoundTopic] = {}
    left_out: dict[str, str] = {}
    for topic in found:
        short = topic._replace(name=_ROBOT.sub("", topic.name, count=1).removeprefix("/"))
        there = merged.get(short.name)
        if reason := _unusable(short):
            left_out[topic.name] = reason
        elif there is None:
            merged[short.name] = short
        elif there.type != short.type:
            left_out[topic.name] = f"type {short.type}, but another robot's is {there.type}"
        else:
            merged[short.name] = there._replace(n_messages=there.n_messages + short.n_messages)
    if wanted:
        return _select(merged, left_out, wanted, source)
    ranked = sorted(
        (each for each in merged.values() if not _OWN.fullmatch(each.name)),
        key=lambda each: (_is_large(each), -each.n_messages, each.name),
    )
    left_out |= {each.name: "ROS internal" for each in merged.values() if _OWN.fullmatch(each.name)}
    left_out |= {
        each.name: f"no room: {MOST_TOPICS} topics, {RULE}" for each in ranked[MOST_TOPICS:]
    }
    return Choice(_some(ranked[:MOST_TOPICS], source), left_out)


def named(texts: list[str]) -> list[FoundTopic]:
    """Topics written as NAME:TYPE. Raises UserError."""
    pairs = []
    for text in texts:
        name, colon, kind = text.partition(":")
        if not colon:
            raise UserError(
                f'--topic: got "{text}"; allowed: NAME:TYPE, such as odom:nav_msgs/msg/Odometry'
            )
        pairs.append((name, kind))
    try:
        registry = make_registry(pairs, "--topic")
    except RegistryError as error:
        raise UserError(str(error)) from None
    if len(registry) > MOST_TOPICS:
        raise UserError(f"--topic: {len(registry)} topics; allowed: at most {MOST_TOPICS}")
    return [FoundTopic(topic.name, topic.type) for topic in registry.topics]


def _select(
    merged: dict[str, FoundTopic], left_out: dict[str, str], wanted: list[str], source: str
) -> Choice:
    names = list(dict.fromkeys(_ROBOT.sub("", each, count=1).removeprefix("/") for each in wanted))
    for name in names:
        if name not in merged:
            raise UserError(f'--topic: got "{name}"; allowed: {", ".join(merged)} ({source})')
    if len(names) > MOST_TOPICS:
        raise UserError(f"--topic: {len(names)} topics; allowed: at most {MOST_TOPICS}")
    rest = {name: "not requested" for name in merged if name not in names}
    return Choice([merged[name] for name in names], left_out | rest)


def _some(topics: list[FoundTopic], source: str) -> list[FoundTopic]:
    if not topics:
        raise UserError(f"{source}: has no topic that fits a registry")
    return topics


def _unusable(topic: FoundTopic) -> str:
    try:
        make_registry([(topic.name, topic.type)])
    except RegistryError:
        return f"not a valid registry type ({topic.type})"
    return ""


def _is_large(topic: FoundTopic) -> bool:
    return topic.type.replace("/msg/", "/").replace("/", "/msg/") in UNBOUNDED_TYPES
