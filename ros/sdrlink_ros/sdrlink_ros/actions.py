"""The topics of actions: feedback and status, which are not services."""

import hashlib
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any

from sdrlink_ros import qos
from sdrlink_ros.kinds import Kind, UnknownTypeError, kind
from sdrlink_ros.names import Names
from sdrlink_ros.outgoing import Spec
from sdrlinkd.calls import (
    ACTION,
    FEEDBACK,
    SEND_GOAL,
    STATUS,
    STATUS_TYPE,
    Service,
    feedback_type,
    of_action,
    with_action,
)
from sdrlinkd.client import MAX_KEY_BYTES, Message

TYPES = {FEEDBACK: "sdrlink_ros/msg/Feedback", STATUS: "sdrlink_ros/msg/Status"}
MOST_STATUSES = 256


def declarations(offered: Mapping[str, Service]) -> list[dict[str, Any]]:
    """The topics between bridges for these services, as arguments of the verb `declare`."""
    if not _actions(offered):
        return []
    latched = {"durability": "transient_local", "depth": 1}
    return [
        {"name": f"/{FEEDBACK}", "type": TYPES[FEEDBACK], "reliability": "best_effort"},
        {"name": f"/{STATUS}", "type": TYPES[STATUS], **latched},
    ]


def specs(offered: Mapping[str, Service]) -> dict[str, Spec]:
    """Subscriptions to the topics of the actions among the services offered, by topic.

    Each message is sent with the action's name ahead; the newest of each action counts.
    """
    found = {}
    for name, service in _actions(offered).items():
        action = service.name.split(ACTION)[0]
        head = with_action(action)
        for inner, kind_ in _kinds(service).items():
            topic = _topic(name, inner)
            is_latched = inner == STATUS
            found[topic] = Spec(
                topic, kind_, f"/{inner}", None, True, is_latched, head, _key(action.encode())
            )
    return found


class Outlets:
    """Publishes feedback and status of other robots' actions. One thread uses it."""

    def __init__(self, node: Any, names: Names) -> None:  # noqa: ANN401
        self._node = node
        self._names = names
        self._publishers: dict[tuple[str, str], tuple[Any, Kind]] = {}
        self._status: OrderedDict[str, bytes] = OrderedDict()
        """The last status of each action, by its name here."""

    def settle(self, proxies: Mapping[str, Service]) -> None:
        """Publish the topics of the actions among the proxies, by name here."""
        actions = _actions(proxies)
        for key in [each for each in self._publishers if each[0] not in actions]:
            self._node.destroy_publisher(self._publishers.pop(key)[0])
        for name, service in actions.items():
            for inner, kind_ in _kinds(service).items():
                if (name, inner) not in self._publishers:
                    self._open(name, inner, kind_)

    def publish(self, robot: int, message: Message) -> None:
        """Publish a message of another robot's action."""
        inner = next((each for each in TYPES if message.topic.endswith(f"/{each}")), "")
        found = of_action(message.payload)
        if found is None or not inner:
            return
        here, cdr = self._names.here(robot, found.action.lstrip("/")), found.cdr
        if inner == STATUS:
            # It may come before the directory that names the action.
            self._status[here] = cdr
            self._status.move_to_end(here)
            while len(self._status) > MOST_STATUSES:
                self._status.popitem(last=False)
        publisher, kind_ = self._publishers.get((here, inner), (None, None))
        if publisher is not None and kind_ is not None and kind_.fits(cdr):
            publisher.publish(cdr)

    def _open(self, name: str, inner: str, kind_: Kind) -> None:
        profile = qos.publisher(inner == STATUS, False, 1)
        publisher = self._node.create_publisher(kind_.message, _topic(name, inner), profile)
        self._publishers[name, inner] = publisher, kind_
        last = self._status.get(name, b"")
        if inner == STATUS and kind_.fits(last):
            publisher.publish(last)


def _actions(services: Mapping[str, Service]) -> dict[str, Service]:
    """The services that send goals, by the names of their actions."""
    return {
        name.split(ACTION)[0]: service
        for name, service in services.items()
        if name.endswith(SEND_GOAL)
    }


def _kinds(service: Service) -> dict[str, Kind]:
    """The types of the topics of an action, of which the service sends goals."""
    try:
        feedback = kind(feedback_type(service))
        return {FEEDBACK: feedback, STATUS: kind(STATUS_TYPE)}
    except UnknownTypeError:
        return {}


def _topic(action: str, inner: str) -> str:
    return f"{action}{ACTION}{inner.rpartition('/')[2]}"


def _key(action: bytes) -> str:
    """A producer key for an action."""
    if len(action) <= MAX_KEY_BYTES:
        return action.decode()
    return hashlib.sha256(action).hexdigest()[:MAX_KEY_BYTES]
