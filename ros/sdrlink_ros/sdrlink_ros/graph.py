"""What the ROS graph of this robot shows: topics that its nodes publish, and other bridges."""

import re
from collections.abc import Sequence
from typing import Any

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from sdrlink_ros.offer import Offer

BRIDGE = "sdrlink_bridge"
"""Beginning of the names of a bridge's nodes."""
_BRIDGE_OF = re.compile(rf"{BRIDGE}_(\d+)")


def offers(node: Any) -> dict[str, Offer]:  # noqa: ANN401
    """The topics on the graph of `node` that others than bridges publish, by name."""
    found = {}
    for name, _ in node.get_topic_names_and_types():
        theirs = [
            each
            for each in node.get_publishers_info_by_topic(name)
            if not each.node_name.startswith(BRIDGE)
        ]
        if theirs:
            found[name] = _offer(name, theirs)
    return found


def _offer(name: str, publishers: Sequence[Any]) -> Offer:
    profiles = [each.qos_profile for each in publishers]
    hashes = [type_hash(each) for each in publishers]
    nodes = {f"{each.node_namespace.rstrip('/')}/{each.node_name}" for each in publishers}
    return Offer(
        name,
        tuple(sorted({each.topic_type for each in publishers})),
        next(iter(sorted(filter(None, hashes))), ""),
        all(each.reliability == ReliabilityPolicy.RELIABLE for each in profiles),
        all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in profiles),
        len(publishers),
        max(each.depth for each in profiles) if all(each.depth for each in profiles) else 0,
        tuple(sorted(nodes)),
    )


def type_hash(endpoint: Any) -> str:  # noqa: ANN401
    """The RIHS01 hash that an endpoint tells; empty if it tells none (before Iron)."""
    told = str(getattr(endpoint, "topic_type_hash", ""))
    is_known = re.fullmatch(r"RIHS01_[0-9a-f]{64}", told) and not told.endswith("0" * 64)
    return told if is_known else ""


def own_hash(node: Any, name: str) -> str:  # noqa: ANN401
    """The hash of the type under which a bridge publishes a topic; empty if unknown."""
    own = (
        type_hash(each)
        for each in node.get_publishers_info_by_topic(name)
        if each.node_name == node.get_name()
    )
    return next(own, "")


def other_bridges(node: Any, own: int) -> list[int]:  # noqa: ANN401
    """The ids of other robots whose bridges are on this graph."""
    found = (_BRIDGE_OF.fullmatch(name) for name, _ in node.get_node_names_and_namespaces())
    return sorted({int(each[1]) for each in found if each is not None} - {own})
