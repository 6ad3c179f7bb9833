"""What a drive's file is called, and its topics."""

import re
from typing import NamedTuple

import msgspec

DRIVE = "drive.mcap"
STATUS, EVENT = "status", "event"
_REPORT = re.compile(r"/sdrlink/robot_(\d+)/(status|event)")
_SENT = re.compile(r"/sdrlink/robot_(\d+)/sent(/.+)")
_RECEIVED = re.compile(r"/sdrlink/robot_(\d+)/from_(\d+)(/.+)")


class Event(msgspec.Struct, frozen=True):
    """Something that happened at a robot, in a sentence."""

    robot: int
    """Id of the robot."""
    level: str
    """info | warning | error"""
    text: str
    """What happened."""


class Passage(NamedTuple):
    """A message's topic: which robot's it is, and who received it; None: as it was published."""

    robot: int
    at: int | None
    topic: str


def topic_of(robot: int, what: str) -> str:
    """The topic of a robot's reports, or of its events."""
    return f"/sdrlink/robot_{robot}/{what}"


def sent(robot: int, topic: str) -> str:
    """The topic of messages as a robot's own programs publish them."""
    return f"/sdrlink/robot_{robot}/sent{topic}"


def received(at: int, robot: int, topic: str) -> str:
    """The topic of a robot's messages as another one received them."""
    return f"/sdrlink/robot_{at}/from_{robot}{topic}"


def read_report(topic: str) -> tuple[int, str] | None:
    """(robot, STATUS or EVENT) of a topic; None for any other topic."""
    found = _REPORT.fullmatch(topic)
    return None if found is None else (int(found[1]), found[2])


def read_passage(topic: str) -> Passage | None:
    """What a topic of messages means; None for any other topic."""
    if found := _SENT.fullmatch(topic):
        return Passage(int(found[1]), None, found[2])
    if found := _RECEIVED.fullmatch(topic):
        return Passage(int(found[2]), int(found[1]), found[3])
    return None
