"""Which commands from Foxglove are taken: no I/O, no Foxglove."""

import re
from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

ENCODINGS = ("cdr", "json")
MOST_ROBOT = 254
MOST_SHOWN = 80
"""Longest text from a client that a sentence repeats."""
_NAME = re.compile(r"/robot_(\d{1,3})(/\w+(?:/\w+)*)", re.ASCII)
_TYPE = re.compile(r"(\w+)/(?:msg/)?(\w+)", re.ASCII)


class Command(NamedTuple):
    """What a client may publish: `topic`, with its leading slash, of `robot`."""

    robot: int
    topic: str
    type: str
    encoding: str

    @property
    def name(self) -> str:
        """What the client calls it."""
        return f"/robot_{self.robot}{self.topic}"


def judge(name: str, kind: str, encoding: str, patterns: Sequence[str]) -> Command | str:
    """The command that a client wants to publish as `name`, or in a sentence why it is refused."""
    shown = f"publish: got {_shown(name)}"
    if not any(fnmatchcase(name, each) for each in patterns):
        allowed = ", ".join(patterns) or "none"
        return f"{shown}; allowed: {allowed}; --publish of the bridge names what is"
    found = _NAME.fullmatch(name)
    if found is None or int(found[1]) > MOST_ROBOT:
        return f"{shown}; allowed: topics of a robot, such as /robot_2/cmd_vel"
    kinds = _TYPE.fullmatch(kind)
    if kinds is None:
        return f"{name}: type: got {_shown(kind)}; allowed: pkg/msg/Name"
    if encoding not in ENCODINGS:
        return f"{name}: encoding: got {_shown(encoding)}; allowed: {', '.join(ENCODINGS)}"
    return Command(int(found[1]), found[2], f"{kinds[1]}/msg/{kinds[2]}", encoding)


def _shown(text: str) -> str:
    """A client's text, fit for a sentence and for a line of the log."""
    plain = "".join(each if each.isprintable() else "?" for each in text[:MOST_SHOWN])
    return f'"{plain}"'
