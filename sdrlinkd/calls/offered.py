"""The services that a robot offers to the others, told as text, and where calls go."""

import json
from collections.abc import Iterable
from typing import NamedTuple

ACTION = "/_action/"
SEND_GOAL = f"{ACTION}send_goal"
INNER = "_sdrlink/"
"""Beginning of the names that bridges use among themselves."""
DIRECTORY, CALLS = f"{INNER}services", f"{INNER}calls"
FEEDBACK, STATUS = f"{INNER}feedback", f"{INNER}status"
CALL_TYPE, TEXT = "sdrlink_ros/msg/Call", "std_msgs/msg/String"
STATUS_TYPE = "action_msgs/msg/GoalStatusArray"
MOST_TOLD = 200
MOST_NAME = 200
"""Longest name of a service, in characters; a packet has an octet for its length."""
_STRING_HEAD = 8
"""Octets of encapsulation and length before the text of a std_msgs/String."""


class Service(NamedTuple):
    """A service by its name at its robot, with its type and, if known, the hash of its request."""

    name: str
    kind: str
    hash: str


def calls_name(robot: int) -> str:
    """The name on the air of the topic of calls to a robot, and of answers to it."""
    return f"robot_{robot}/{CALLS}"


def told(services: Iterable[Service]) -> bytes:
    """Services as a std_msgs/String in CDR."""
    text = json.dumps([list(each) for each in services], separators=(",", ":")).encode() + b"\0"
    return b"\0\1\0\0" + len(text).to_bytes(4, "little") + text


def understood(cdr: bytes) -> list[Service] | None:
    """The services in such a message; None if it is none."""
    try:
        given = json.loads(cdr[_STRING_HEAD:].rstrip(b"\0").decode())
        services = [Service(*map(str, each)) for each in given[:MOST_TOLD]]
    except (ValueError, TypeError, RecursionError):
        return None
    return [each for each in services if each.name.startswith("/") and len(each.name) <= MOST_NAME]


def feedback_type(service: Service) -> str:
    """The type of the feedback of an action, of which the service sends goals."""
    return service.kind.removesuffix("_SendGoal") + "_FeedbackMessage"


class OfAction(NamedTuple):
    """A message of a topic of an action: the action's name at its robot, and the message."""

    action: str
    cdr: bytes


def with_action(action: str) -> bytes:
    """What stands ahead of a message of an action's topic."""
    name = action.encode()
    return b"\0\1\0\0" + bytes((len(name),)) + name


def of_action(payload: bytes) -> OfAction | None:
    """The message behind what `with_action` made; None if it is none."""
    body = payload[4:]
    length = body[0] if body else 0
    name, cdr = body[1 : 1 + length], body[1 + length :]
    return OfAction(name.decode(errors="replace"), cdr) if name else None
