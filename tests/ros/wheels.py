"""A Python with rclpy, in an environment of its own that is kept between runs."""

import os
from pathlib import Path

from benchmarks.environments import ROOT, EnvironmentLackingError, interpreter, variables

BRIDGE = ROOT / "ros/sdrlink_ros"
REQUIRED = "SDRLINK_ROS"
"""Set to 1 where the tests must not be skipped."""


def python() -> Path:
    """The interpreter, installed now if it is not there. Raises EnvironmentLackingError."""
    return Path(interpreter("ros"))


def in_domain(domain: int, **more: object) -> dict[str, str]:
    """The environment of a ROS program in `domain`, on this host alone."""
    return {
        **variables(),
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(BRIDGE)]),
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        **{key: str(value) for key, value in more.items()},
    }


def lacking() -> str:
    """Why nothing with rclpy can run here; "" if it can."""
    try:
        python()
    except EnvironmentLackingError as error:
        return str(error)
    return ""
