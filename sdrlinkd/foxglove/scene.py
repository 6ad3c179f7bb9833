"""Draws robots where they say that they are: in 3D, and on the map of the Earth."""

from foxglove import Context
from foxglove.channels import FrameTransformsChannel, LocationFixChannel, SceneUpdateChannel
from foxglove.messages import (
    ArrowPrimitive,
    Color,
    Duration,
    FrameTransform,
    FrameTransforms,
    LocationFix,
    LocationFixPositionCovarianceType,
    Pose,
    Quaternion,
    SceneEntity,
    SceneUpdate,
    TextPrimitive,
    Timestamp,
    Vector3,
)

from sdrlinkd.adapters import Fix, Place, read_place
from sdrlinkd.client import Message
from sdrlinkd.errors import CdrError

ROBOTS, FRAMES = "/sdrlink/robots", "/sdrlink/frames"
WORLD = "map"
SECOND_NS = 1_000_000_000
LASTS_S = 10
"""A robot that has told nothing for this long, in s, is not drawn any more."""
PREFERRED_NS = 5 * SECOND_NS
"""For so long in ns after a place in a shared frame, one in a robot's own frame does not count."""
COLORS = (
    (0.90, 0.30, 0.24), (0.20, 0.60, 0.86), (0.18, 0.80, 0.44), (0.95, 0.61, 0.07),
    (0.61, 0.35, 0.71), (0.10, 0.74, 0.61), (0.91, 0.47, 0.70), (0.58, 0.65, 0.65),
)  # fmt: skip
_COVARIANCES = (
    LocationFixPositionCovarianceType.Unknown,
    LocationFixPositionCovarianceType.Approximated,
    LocationFixPositionCovarianceType.DiagonalKnown,
    LocationFixPositionCovarianceType.Known,
)
"""By the number in sensor_msgs/NavSatFix."""


class Scene:
    """The robots in 3D, their frames, and their fixes, each a topic."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._robots = SceneUpdateChannel(ROBOTS, context=context)
        self._frames = FrameTransformsChannel(FRAMES, context=context)
        self._fixes: dict[int, LocationFixChannel] = {}
        self._shared_ns: dict[int, int] = {}
        """When each robot last told its place in a shared frame."""
        self.unreadable = 0
        """Messages that are not of their type."""

    def take(self, message: Message) -> None:
        """Draw what a message says of its robot's place, if it says something."""
        robot, time_ns = message.source, message.received_ns
        try:
            found = read_place(robot, message.type, message.payload)
        except CdrError:
            self.unreadable += 1
            return
        if isinstance(found, Fix):
            self._show_fix(robot, found, time_ns)
        elif found is not None and self._counts(robot, found, time_ns):
            self._show(robot, found, time_ns)

    def _counts(self, robot: int, place: Place, time_ns: int) -> bool:
        """Whether this place is the best known: one on the map, else one from odometry."""
        if place.is_shared:
            self._shared_ns[robot] = time_ns
        return place.is_shared or time_ns - self._shared_ns.get(robot, 0) > PREFERRED_NS

    def _show(self, robot: int, place: Place, time_ns: int) -> None:
        stamp, name = _stamp(time_ns), f"robot_{robot}"
        x, y, z = place.position
        turn = Quaternion(**dict(zip("xyzw", place.turn, strict=True)))
        transforms = [
            FrameTransform(
                timestamp=stamp, parent_frame_id=place.frame, child_frame_id=name,
                translation=Vector3(x=x, y=y, z=z), rotation=turn,
            )
        ]  # fmt: skip
        if not place.is_shared:
            # Nobody knows where this robot's odometry began, so it begins at the map's origin.
            transforms.append(
                FrameTransform(
                    timestamp=stamp, parent_frame_id=WORLD, child_frame_id=place.frame,
                    translation=Vector3(), rotation=Quaternion(w=1.0),
                )
            )  # fmt: skip
        self._frames.log(FrameTransforms(transforms=transforms), log_time=time_ns)
        here, above = Vector3(x=x, y=y, z=z), Vector3(x=x, y=y, z=z + 0.6)
        arrow = ArrowPrimitive(
            pose=Pose(position=here, orientation=turn), color=_color(robot), shaft_length=0.5,
            shaft_diameter=0.12, head_length=0.25, head_diameter=0.25,
        )  # fmt: skip
        label = TextPrimitive(
            pose=Pose(position=above, orientation=Quaternion(w=1.0)), billboard=True,
            font_size=14.0, scale_invariant=True, color=_color(robot), text=f"robot {robot}",
        )  # fmt: skip
        entity = SceneEntity(
            timestamp=stamp, frame_id=place.frame, id=name, lifetime=Duration(LASTS_S),
            arrows=[arrow], texts=[label],
        )  # fmt: skip
        self._robots.log(SceneUpdate(entities=[entity]), log_time=time_ns)

    def _show_fix(self, robot: int, fix: Fix, time_ns: int) -> None:
        channel = self._fixes.get(robot)
        if channel is None:
            topic = f"/sdrlink/robot_{robot}/location"
            channel = self._fixes[robot] = LocationFixChannel(topic, context=self._context)
        known = fix.covariance_type if fix.covariance_type < len(_COVARIANCES) else 0
        channel.log(
            LocationFix(
                timestamp=_stamp(time_ns), frame_id=fix.frame, latitude=fix.latitude,
                longitude=fix.longitude, altitude=fix.altitude, color=_color(robot),
                position_covariance=fix.covariance,
                position_covariance_type=_COVARIANCES[known],
            ),
            log_time=time_ns,
        )  # fmt: skip


def _stamp(time_ns: int) -> Timestamp:
    return Timestamp(*divmod(time_ns, SECOND_NS))


def _color(robot: int) -> Color:
    red, green, blue = COLORS[robot % len(COLORS)]
    return Color(r=red, g=green, b=blue, a=1.0)
