"""A Python with rclpy, in an environment of its own that is kept between runs."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
ENVIRONMENT = ROOT / ".venv/ros"
PACKAGES = (
    "ros-jazzy-rclpy[fastrtps]", "ros-jazzy-nav-msgs", "ros-jazzy-sensor-msgs",
    "ros-jazzy-geometry-msgs", "ros-jazzy-std-msgs", "ros-jazzy-test-msgs",
    "ros-jazzy-diagnostic-msgs", "ros-jazzy-std-srvs", "pyzmq",
)  # fmt: skip
REQUIRED = "SDRLINK_ROS"
"""Set to 1 where the tests must not be skipped."""
INSTALL_S = 600


def python() -> Path:
    """The interpreter, installed now if it is not there. Raises RuntimeError with the cause."""
    found, stamp = ENVIRONMENT / "bin/python", ENVIRONMENT / ".installed"
    wanted = "\n".join(PACKAGES)
    if stamp.exists() and stamp.read_text() == wanted:
        return found
    for command in (
        [sys.executable, "-m", "venv", "--clear", ENVIRONMENT],
        [found, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PACKAGES],
    ):
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=INSTALL_S, check=False, env=plain()
        )
        if done.returncode:
            raise RuntimeError(f"no rclpy wheels for this Python: {done.stderr.strip()[-300:]}")
    stamp.write_text(wanted)
    return found


def plain() -> dict[str, str]:
    """The environment without what another environment's rclpy has set."""
    left_out = ("_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH", "PYTHONPATH", "VIRTUAL_ENV")
    return {key: value for key, value in os.environ.items() if key not in left_out}


def in_domain(domain: int, **more: object) -> dict[str, str]:
    """The environment of a ROS program in `domain`, on this host alone."""
    paths = os.pathsep.join([str(ROOT), str(ROOT / "ros/sdrlink_ros")])
    return {
        **plain(),
        "PYTHONPATH": paths,
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        **{key: str(value) for key, value in more.items()},
    }
