"""Where a robot is, by the message that says so."""

from collections.abc import Callable
from math import atan2, cos, isfinite, radians
from typing import Any, NamedTuple

from sdrlinkd.adapters import from_cdr
from sdrlinkd.errors import CdrError

EARTH_M = 6_371_008.8
"""Mean radius of the earth."""
NO_FIX = -1


class Position(NamedTuple):
    """A place in m, east and north; `heading` in rad from east, counterclockwise, if known.

    With `is_geographic`, `x` and `y` are longitude and latitude in degrees instead.
    """

    x: float
    y: float
    heading: float | None = None
    is_geographic: bool = False


def position_in(cdr: bytes, kind: str) -> Position | None:
    """The position in a message of a type in POSITIONS; None if it has none that is finite."""
    try:
        found = POSITIONS[kind](from_cdr(cdr, kind))
    except CdrError:
        return None
    return found if found and isfinite(found.x) and isfinite(found.y) else None


def metres_from(origin: Position, there: Position) -> Position:
    """A geographic position in m from `origin`, for distances of some kilometres."""
    east = radians(there.x - origin.x) * EARTH_M * cos(radians(origin.y))
    return Position(east, radians(there.y - origin.y) * EARTH_M, there.heading)


def _pose(pose: Any) -> Position:  # noqa: ANN401
    at, turn = pose.position, pose.orientation
    sine = 2 * (turn.w * turn.z + turn.x * turn.y)
    cosine = 1 - 2 * (turn.y * turn.y + turn.z * turn.z)
    heading = atan2(sine, cosine)
    return Position(at.x, at.y, heading if isfinite(heading) else None)


def _fix(message: Any) -> Position | None:  # noqa: ANN401
    if message.status.status == NO_FIX:
        return None
    return Position(message.longitude, message.latitude, is_geographic=True)


POSITIONS: dict[str, Callable[[Any], Position | None]] = {
    "nav_msgs/msg/Odometry": lambda message: _pose(message.pose.pose),
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda message: _pose(message.pose.pose),
    "geometry_msgs/msg/PoseWithCovariance": lambda message: _pose(message.pose),
    "geometry_msgs/msg/PoseStamped": lambda message: _pose(message.pose),
    "sensor_msgs/msg/NavSatFix": _fix,
}
"""The types of messages that say where a robot is, those that are preferred first."""
PREFERENCE = {kind: rank for rank, kind in enumerate(POSITIONS)}
