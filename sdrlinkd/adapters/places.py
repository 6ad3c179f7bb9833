"""Where robots are, read from the messages that they send."""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from sdrlinkd.adapters.typestore import from_cdr

SHARED_FRAMES = ("map", "earth", "world")
"""Frames that all robots of a team mean alike; any other one is a robot's own."""
MOST_FRAME = 64
"""Longest name of a frame, as it comes from the air."""
NO_TURN = (0.0, 0.0, 0.0, 1.0)
NO_FIX = -1
"""NavSatStatus.STATUS_NO_FIX."""


class Place(NamedTuple):
    """Where a robot is in `frame`: `position` in m (x, y, z), `turn` a quaternion (x, y, z, w)."""

    frame: str
    position: tuple[float, float, float]
    turn: tuple[float, float, float, float]

    @property
    def is_shared(self) -> bool:
        """Whether all robots mean the same by the frame."""
        return self.frame in SHARED_FRAMES


class Fix(NamedTuple):
    """A satellite fix: degrees, and m above the ellipsoid; `covariance` in m², row by row."""

    frame: str
    latitude: float
    longitude: float
    altitude: float
    covariance: list[float]
    covariance_type: int


def read_place(robot: int, kind: str, cdr: bytes) -> Place | Fix | None:
    """What a message of type `kind` says of where `robot` is; None if it says nothing.

    Raises CdrError.
    """
    reader = _READERS.get(kind)
    return None if reader is None else reader(robot, from_cdr(cdr, kind))


def _frame(robot: int, name: str) -> str:
    """A frame by a name that is one robot's alone, unless it is shared."""
    name = name.lstrip("/")[:MOST_FRAME]
    own = f"robot_{robot}/"
    return name if name in SHARED_FRAMES or name.startswith(own) else f"{own}{name}"


def _place(robot: int, frame: str, pose: Any) -> Place | None:  # noqa: ANN401
    at, by = pose.position, pose.orientation
    position, turn = (at.x, at.y, at.z), (by.x, by.y, by.z, by.w)
    if not all(map(math.isfinite, (*position, *turn))):
        return None
    # Who does not know its orientation often sends zeros, which are no turn at all.
    return Place(_frame(robot, frame), position, turn if any(turn) else NO_TURN)


def _fix(robot: int, message: Any) -> Fix | None:  # noqa: ANN401
    given = message.latitude, message.longitude, message.altitude
    latitude, longitude, altitude = given
    if message.status.status == NO_FIX or not all(map(math.isfinite, (latitude, longitude))):
        return None
    if abs(latitude) > 90 or abs(longitude) > 180:
        return None
    # Receivers without a height send NaN.
    height = altitude if math.isfinite(altitude) else 0.0
    covariance = [float(each) for each in message.position_covariance]
    return Fix(
        _frame(robot, message.header.frame_id), latitude, longitude, height, covariance,
        message.position_covariance_type,
    )  # fmt: skip


_READERS: Mapping[str, Callable[[int, Any], Place | Fix | None]] = {
    "nav_msgs/msg/Odometry": lambda robot, got: _place(robot, got.header.frame_id, got.pose.pose),
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda robot, got: _place(
        robot, got.header.frame_id, got.pose.pose
    ),
    "geometry_msgs/msg/PoseWithCovariance": lambda robot, got: _place(robot, "", got.pose),
    "geometry_msgs/msg/PoseStamped": lambda robot, got: _place(
        robot, got.header.frame_id, got.pose
    ),
    "sensor_msgs/msg/NavSatFix": _fix,
}
PLACES = tuple(_READERS)
"""The types of messages that say where a robot is, those that are preferred first."""
