"""Where a robot is drawn, by the message that says where it is."""

from math import atan2, cos, radians
from typing import NamedTuple

from sdrlinkd.adapters import PLACES, Place, read_place
from sdrlinkd.errors import CdrError

EARTH_M = 6_371_008.8
"""Mean radius of the earth."""
PREFERENCE = {kind: rank for rank, kind in enumerate(PLACES)}


class Position(NamedTuple):
    """A place in m, east and north; `heading` in rad from east, counterclockwise, if known.

    With `is_geographic`, `x` and `y` are longitude and latitude in degrees instead.
    """

    x: float
    y: float
    heading: float | None = None
    is_geographic: bool = False


def position_in(robot: int, cdr: bytes, kind: str) -> Position | None:
    """The position in a message of a robot, of a type in PREFERENCE; None if it has none."""
    try:
        found = read_place(robot, kind, cdr)
    except CdrError:
        return None
    if found is None:
        return None
    if isinstance(found, Place):
        x, y, z, w = found.turn
        heading = atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
        return Position(found.position[0], found.position[1], heading)
    return Position(found.longitude, found.latitude, is_geographic=True)


def metres_from(origin: Position, there: Position) -> Position:
    """A geographic position in m from `origin`, for distances of some kilometres."""
    east = radians(there.x - origin.x) * EARTH_M * cos(radians(origin.y))
    return Position(east, radians(there.y - origin.y) * EARTH_M, there.heading)
