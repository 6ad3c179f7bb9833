"""A simulated robot for demonstrations: it drives a path and publishes typical topics."""

import math
from collections.abc import Callable, Iterator
from heapq import merge
from random import Random
from typing import Any

import numpy as np

from sdrlinkd.adapters.bags import BagMessage, BagTopic
from sdrlinkd.adapters.typestore import empty, to_cdr

ODOM_HZ = 30
SCAN_HZ = 10
IMU_HZ = 50
CMD_VEL_HZ = 10
SCAN_BEAMS = 360

# Half the side of the room in which the robot drives, in m; its laser sees the walls.
ROOM_HALF_M = 6.0
PATH_RADIUS_M = 2.5
PATH_PERIOD_S = 12.0

_TYPES = {
    "/cmd_vel": ("geometry_msgs/msg/Twist", CMD_VEL_HZ),
    "/imu": ("sensor_msgs/msg/Imu", IMU_HZ),
    "/odom": ("nav_msgs/msg/Odometry", ODOM_HZ),
    "/scan": ("sensor_msgs/msg/LaserScan", SCAN_HZ),
}


class Pose:
    """The robot's pose and motion at `t` s on its figure-eight path."""

    def __init__(self, t: float) -> None:
        w = 2 * math.pi / PATH_PERIOD_S
        self.x = PATH_RADIUS_M * math.sin(w * t)
        self.y = PATH_RADIUS_M * math.sin(2 * w * t) / 2
        dx = PATH_RADIUS_M * w * math.cos(w * t)
        dy = PATH_RADIUS_M * w * math.cos(2 * w * t)
        ddx = -PATH_RADIUS_M * w * w * math.sin(w * t)
        ddy = -2 * PATH_RADIUS_M * w * w * math.sin(2 * w * t)
        self.heading = math.atan2(dy, dx)
        self.speed = math.hypot(dx, dy)
        self.turn_rate = (dx * ddy - dy * ddx) / self.speed**2
        self.acceleration = (dx * ddx + dy * ddy) / self.speed


# Fills in a message of one type; message classes are made from their definitions at run time.
Builder = Callable[[Any, Pose, Random], None]


def _odometry(message: Any, pose: Pose, rng: Random) -> None:  # noqa: ANN401
    message.header.frame_id = "odom"
    message.child_frame_id = "base_link"
    position, orientation = message.pose.pose.position, message.pose.pose.orientation
    position.x = pose.x + rng.gauss(0, 0.002)
    position.y = pose.y + rng.gauss(0, 0.002)
    orientation.z, orientation.w = math.sin(pose.heading / 2), math.cos(pose.heading / 2)
    message.twist.twist.linear.x = pose.speed
    message.twist.twist.angular.z = pose.turn_rate
    message.pose.covariance[[0, 7]] = 0.002**2


def _twist(message: Any, pose: Pose, _: Random) -> None:  # noqa: ANN401
    message.linear.x = pose.speed
    message.angular.z = pose.turn_rate


def _imu(message: Any, pose: Pose, rng: Random) -> None:  # noqa: ANN401
    message.header.frame_id = "imu"
    message.orientation.z = math.sin(pose.heading / 2)
    message.orientation.w = math.cos(pose.heading / 2)
    message.angular_velocity.z = pose.turn_rate + rng.gauss(0, 0.01)
    message.linear_acceleration.x = pose.acceleration + rng.gauss(0, 0.05)
    message.linear_acceleration.y = pose.speed * pose.turn_rate + rng.gauss(0, 0.05)
    message.linear_acceleration.z = 9.81 + rng.gauss(0, 0.05)


def _scan(message: Any, pose: Pose, rng: Random) -> None:  # noqa: ANN401
    message.header.frame_id = "laser"
    step = 2 * math.pi / SCAN_BEAMS
    message.angle_min, message.angle_max = -math.pi, math.pi - step
    message.angle_increment = step
    message.scan_time = 1 / SCAN_HZ
    message.range_min, message.range_max = 0.12, 3 * ROOM_HALF_M
    angles = pose.heading + message.angle_min + step * np.arange(SCAN_BEAMS)
    with np.errstate(divide="ignore"):
        to_wall_x = (np.copysign(ROOM_HALF_M, np.cos(angles)) - pose.x) / np.cos(angles)
        to_wall_y = (np.copysign(ROOM_HALF_M, np.sin(angles)) - pose.y) / np.sin(angles)
    noise = np.array([rng.gauss(0, 0.01) for _ in range(SCAN_BEAMS)])
    message.ranges = (np.minimum(to_wall_x, to_wall_y) + noise).astype(np.float32)


class BuiltInRobot:
    """A robot with odometry at 30 Hz, laser scans and velocity commands at 10 Hz, IMU at 50 Hz.

    The same seed gives the same bytes. It has the interface of a bag.
    """

    damage = ""

    def __init__(self, namespace: str, duration_s: float, seed: int) -> None:
        self._namespace = "/" + namespace.strip("/")
        self._duration_s = duration_s
        self._seed = seed
        # Serialize each type once now: the first time is slow and would disturb measurements.
        for kind, _ in _TYPES.values():
            to_cdr(empty(kind), kind)

    def topics(self) -> list[BagTopic]:
        """The topics that the robot publishes, with their numbers of messages."""
        return [
            BagTopic(self._namespace + name, kind, math.ceil(rate * self._duration_s))
            for name, (kind, rate) in _TYPES.items()
        ]

    def messages(self) -> Iterator[BagMessage]:
        """All messages of the robot in order of time."""
        builders = {"/cmd_vel": _twist, "/imu": _imu, "/odom": _odometry, "/scan": _scan}
        streams = [
            self._stream(name, kind, rate, builders[name], Random(self._seed + i))
            for i, (name, (kind, rate)) in enumerate(_TYPES.items())
        ]
        return merge(*streams, key=lambda message: message.time_ns)

    def close(self) -> None:
        """Do nothing, as the robot has no file."""

    def _stream(
        self, name: str, kind: str, rate: int, build: Builder, rng: Random
    ) -> Iterator[BagMessage]:
        for i in range(math.ceil(rate * self._duration_s)):
            t = i / rate
            message = empty(kind)
            build(message, Pose(t), rng)
            if hasattr(message, "header"):
                message.header.stamp.sec = int(t)
                message.header.stamp.nanosec = round((t - int(t)) * 1e9)
            yield BagMessage(self._namespace + name, kind, round(t * 1e9), to_cdr(message, kind))
