"""The services that a robot offers to the others, as found on its graph."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from sdrlink_ros.graph import BRIDGE, type_hash
from sdrlink_ros.names import Names, matches
from sdrlinkd.calls import ACTION, MOST_NAME, Service


class Found(NamedTuple):
    """The services that are offered, by name, and what is wrong with others, in words by name."""

    services: dict[str, Service]
    refused: dict[str, str]


def found(node: Any, names: Names, patterns: Sequence[str]) -> Found:  # noqa: ANN401
    """The services of this robot's nodes that `patterns` name; an action by its own name."""
    servers: dict[str, list[str]] = {}
    kinds: dict[str, str] = {}
    for name, space in node.get_node_names_and_namespaces() if patterns else ():
        if name.startswith(BRIDGE):
            continue
        try:
            told = node.get_service_names_and_types_by_node(name, space)
        except Exception:  # noqa: S112 - the node has gone in this moment
            continue
        for service, types in told:
            is_named = matches(names.local(service).split(ACTION)[0], patterns)
            if is_named and len(service) <= MOST_NAME:
                servers.setdefault(service, []).append(f"{space.rstrip('/')}/{name}")
                kinds[service] = types[0]
    result = Found({}, {})
    for service, nodes in sorted(servers.items()):
        if len(nodes) > 1:
            result.refused[service] = (
                f"{service}: {' and '.join(sorted(nodes))} both offer it; stop one of them"
            )
        else:
            kind, hash_ = kinds[service], request_hash(node, service)
            result.services[service] = Service(names.local(service), kind, hash_)
    return result


def request_hash(node: Any, service: str) -> str:  # noqa: ANN401
    """The hash of a service's request; empty where the middleware does not tell it."""
    topic = f"rq{service}Request"
    endpoints = node.get_subscriptions_info_by_topic(topic, no_mangle=True)
    return next(filter(None, (type_hash(each) for each in endpoints)), "")
