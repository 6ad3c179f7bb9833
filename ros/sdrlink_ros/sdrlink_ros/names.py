"""Names of topics: which are left out, which are commands, and what they are called elsewhere."""

import difflib
import re
from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

from sdrlinkd.client import LEAST_RATE_HZ, MOST_RATE_HZ

NEVER = ("/rosout", "/parameter_events", "/clock", "/diagnostics_agg")
"""Topics that only matter on their own robot."""
LARGE = ("sensor_msgs/msg/Image", "sensor_msgs/msg/PointCloud2")
"""Types that would fill a radio link."""
EVERYTHING = ("*", "/*")
MOST_NEAR = 3


def matches(name: str, patterns: Iterable[str]) -> bool:
    """Whether a topic is among `patterns`, in which `*` stands for any text.

    A pattern without leading slash is meant from the root: `cmd_vel` is `/cmd_vel`.
    """
    return any(fnmatchcase(name, each if each.startswith("/") else f"/{each}") for each in patterns)


def is_hidden(name: str) -> bool:
    """Whether ROS hides a name: a part of it begins with an underscore."""
    return any(part.startswith("_") for part in name.split("/"))


def left_out(name: str, kind: str, allow: Sequence[str], deny: Sequence[str]) -> str:
    """Why a topic of this robot is not offered to the others, in words; empty: it is."""
    if matches(name, deny):
        return "denied by the parameter deny"
    named = [each for each in allow if each not in EVERYTHING]
    if matches(name, named):
        return ""
    if len(named) == len(allow):
        return "not named by the parameter allow"
    if name in NEVER or is_hidden(name):
        return "only for its own robot; name it in the parameter allow to send it"
    if kind in LARGE:
        return f"{kind} is large; name it in the parameter allow to send it"
    return ""


def unused(patterns: Iterable[str], names: Iterable[str]) -> dict[str, list[str]]:
    """The patterns that match none of `names`, each with the nearest names."""
    known = list(names)
    return {
        each: difflib.get_close_matches(each, known, MOST_NEAR, 0.5)
        for each in patterns
        if not any(matches(name, [each]) for name in known)
    }


class Address(NamedTuple):
    """What a name with a robot's prefix means: the robot, and the topic's name there."""

    robot: int
    name: str


class Names:
    """The names of topics by robot; `form` is the prefix, such as `/robot_{src}`.

    Raises ValueError if `form` is no such prefix.
    """

    def __init__(self, own: int, form: str) -> None:
        if form.count("{src}") != 1 or not re.fullmatch(r"(/\w+)+", form.format(src=1)):
            raise ValueError(
                f"rx_format: got {form!r}; allowed: a name that holds {{src}}, as /robot_{{src}}"
            )
        self.own = own
        self._form = form
        before, after = form.split("{src}")
        self._pattern = re.compile(rf"{re.escape(before)}(\d{{1,3}}){re.escape(after)}(/.+)")

    def here(self, robot: int, name: str) -> str:
        """The name under which a topic of another robot appears here."""
        return f"{self._form.format(src=robot)}/{name}"

    def address(self, name: str) -> Address | None:
        """The robot in a name of this graph, and the rest of the name; None: it has no prefix."""
        found = self._pattern.fullmatch(name)
        return None if found is None else Address(int(found[1]), found[2])

    def local(self, name: str) -> str:
        """A name of this robot without its own prefix, if its nodes have one."""
        found = self.address(name)
        return found.name if found is not None and found.robot == self.own else name


def command_name(robot: int, name: str) -> str:
    """What a command is called on the air, without leading slash; `name` has one."""
    return f"robot_{robot}{name}"


def command_for(own: int, name: str) -> str | None:
    """The topic here, with leading slash, of a command on the air to this robot; else None."""
    prefix = f"robot_{own}/"
    return f"/{name[len(prefix) :]}" if name.startswith(prefix) else None


def is_command(name: str) -> bool:
    """Whether a name on the air is that of a command to some robot."""
    return re.match(r"robot_\d{1,3}/", name) is not None


def is_rate(text: str) -> bool:
    """Whether a text is a pattern and a rate in Hz, as in `/robot_2/scan:=2`."""
    pattern, _, hz = text.partition(":=")
    try:
        return bool(pattern) and LEAST_RATE_HZ <= float(hz) <= MOST_RATE_HZ
    except ValueError:
        return False


def rate_of(names: "tuple[str, ...]", rates: "tuple[str, ...]") -> "float | None":
    """How often messages of a topic with these names are enough here, in Hz; None: always."""
    for text in rates:
        pattern, _, hz = text.partition(":=")
        if any(matches(name, (pattern,)) for name in names):
            return float(hz)
    return None
