"""The topics of actions: feedback and status, which are not services."""

import hashlib
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any, NamedTuple

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from sdrlink_ros.directory import ACTION, SEND_GOAL, Service
from sdrlink_ros.kinds import Kind, UnknownTypeError, kind
from sdrlink_ros.names import Names
from sdrlink_ros.packet import ENCAPSULATION
from sdrlinkd.client import Message, MessageRefusedError, Publisher

FEEDBACK, STATUS = "_sdrlink/feedback", "_sdrlink/status"
TYPES = {FEEDBACK: "sdrlink_ros/msg/Feedback", STATUS: "sdrlink_ros/msg/Status"}
STATUS_TYPE = "action_msgs/msg/GoalStatusArray"
MAX_KEY_BYTES = 32
DEPTH = 10
MOST_STATUSES = 256


class Tap(NamedTuple):
    """A subscription to a topic of an action here; `action` is the action's name for others."""

    action: str
    inner: str
    kind: Kind
    subscription: Any


class ActionTopics:
    """Feedback (the newest of each action) and status (latched) of actions, both ways."""

    def __init__(self, node: Any, names: Names) -> None:  # noqa: ANN401
        self._node = node
        self._names = names
        self._taps: dict[str, list[Tap]] = {}
        self._publishers: dict[tuple[str, str], tuple[Any, Kind]] = {}
        self._status: OrderedDict[str, bytes] = OrderedDict()
        """The last status of each action of other robots, by its name here."""

    @property
    def taps(self) -> list[Tap]:
        """The subscriptions that there are."""
        return [tap for taps in self._taps.values() for tap in taps]

    @staticmethod
    def declarations(offered: Mapping[str, Service]) -> list[dict[str, Any]]:
        """The topics between bridges for these services, as arguments of the verb `declare`."""
        if not _actions(offered):
            return []
        latched = {"durability": "transient_local", "depth": 1}
        return [
            {"name": f"/{FEEDBACK}", "type": TYPES[FEEDBACK], "reliability": "best_effort"},
            {"name": f"/{STATUS}", "type": TYPES[STATUS], **latched},
        ]

    def offer(self, offered: Mapping[str, Service]) -> None:
        """Subscribe to the topics of the actions among the services offered, by name here."""
        actions = _actions(offered)
        for name in [each for each in self._taps if each not in actions]:
            for tap in self._taps.pop(name):
                self._node.destroy_subscription(tap.subscription)
        for name, service in actions.items():
            if name not in self._taps:
                self._taps[name] = self._tapped(name, service)

    def show(self, proxies: Mapping[str, Service]) -> None:
        """Publish the topics of the actions among the proxies, by name here."""
        actions = _actions(proxies)
        for key in [each for each in self._publishers if each[0] not in actions]:
            self._node.destroy_publisher(self._publishers.pop(key)[0])
        for name, service in actions.items():
            for inner, kind_ in _kinds(service).items():
                if (name, inner) not in self._publishers:
                    made = self._node.create_publisher(
                        kind_.message, f"{name}{ACTION}{_last(inner)}", _profile(inner)
                    )
                    self._publishers[name, inner] = made, kind_
                    if inner == STATUS and name in self._status:
                        made.publish(self._status[name])

    def forward(self, tap: Tap, out: Publisher) -> None:
        """Send the messages of a subscription that has some."""
        while (taken := tap.subscription.handle.take_message(tap.kind.message, True)) is not None:
            name = tap.action.encode()
            body = ENCAPSULATION + bytes((len(name),)) + name + taken[0]
            try:
                out.send(f"/{tap.inner}", body, key=_key(name), wait=False)
            except MessageRefusedError:
                # It is not declared yet, or too large. The result comes in any case.
                return

    def publish(self, robot: int, message: Message) -> None:
        """Publish a message of another robot's action."""
        inner = next((each for each in TYPES if message.topic.endswith(f"/{each}")), "")
        body = message.payload[len(ENCAPSULATION) :]
        length = body[0] if body else 0
        name, cdr = body[1 : 1 + length], body[1 + length :]
        if not name or not inner or cdr[:2] not in (b"\0\0", b"\0\1"):
            return
        here = self._names.here(robot, name.decode(errors="replace").lstrip("/"))
        found = self._publishers.get((here, inner))
        if inner == STATUS:
            # It may come before the directory that names the action.
            self._status[here] = cdr
            self._status.move_to_end(here)
            while len(self._status) > MOST_STATUSES:
                self._status.popitem(last=False)
        if found is not None and len(cdr) >= found[1].least:
            found[0].publish(cdr)

    def _tapped(self, name: str, service: Service) -> list[Tap]:
        action = service.name.split(ACTION)[0]
        return [
            Tap(
                action, inner, kind_,
                self._node.create_subscription(
                    kind_.message, f"{name}{ACTION}{_last(inner)}", _never, _profile(inner),
                    raw=True,
                ),
            )
            for inner, kind_ in _kinds(service).items()
        ]  # fmt: skip


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
        feedback = kind(service.kind.removesuffix("_SendGoal") + "_FeedbackMessage")
        return {FEEDBACK: feedback, STATUS: kind(STATUS_TYPE)}
    except UnknownTypeError:
        return {}


def _last(inner: str) -> str:
    return inner.rpartition("/")[2]


def _profile(inner: str) -> QoSProfile:
    durability = DurabilityPolicy
    return QoSProfile(
        depth=DEPTH,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability.TRANSIENT_LOCAL if inner == STATUS else durability.VOLATILE,
    )


def _key(name: bytes) -> str:
    """A producer key for an action."""
    if len(name) <= MAX_KEY_BYTES:
        return name.decode(errors="replace")
    return hashlib.sha256(name).hexdigest()[:MAX_KEY_BYTES]


def _never(_: bytes) -> None:
    """The callback that rclpy asks for; no executor calls it."""
