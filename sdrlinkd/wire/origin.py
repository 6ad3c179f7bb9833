"""Names of topics that a gateway sends for a robot elsewhere (wire document, section 7.3)."""

import re
from typing import NamedTuple

from sdrlinkd.wire.registry import BROADCAST

MARK = "@"
"""Begins such names; no ROS name begins with it."""
_OF_ANOTHER = re.compile(r"@(0|[1-9][0-9]{0,2})/([^/].*)", re.ASCII)


class TopicOrigin(NamedTuple):
    """The robot whose topic it is, None for the sender itself, and the topic's name there."""

    robot: int | None
    name: str


def name_for(robot: int, name: str) -> str:
    """The name on the air of topic `name` of robot `robot`, sent by another robot."""
    return f"{MARK}{robot}/{name}"


def read_origin(name: str) -> TopicOrigin:
    """Whose topic a name on the air means."""
    found = _OF_ANOTHER.fullmatch(name) if name.startswith(MARK) else None
    if found is None or int(found[1]) >= BROADCAST:
        return TopicOrigin(None, name)
    return TopicOrigin(int(found[1]), found[2])
