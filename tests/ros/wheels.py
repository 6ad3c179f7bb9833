"""A Python with rclpy, in an environment of its own that is kept between runs."""

from pathlib import Path

from benchmarks.environments import EnvironmentLackingError, in_domain, interpreter, variables

REQUIRED = "SDRLINK_ROS"
"""Set to 1 where the tests must not be skipped."""


def python() -> Path:
    """The interpreter, installed now if it is not there. Raises EnvironmentLackingError."""
    return Path(interpreter("ros"))


def environment(domain: int, **more: object) -> dict[str, str]:
    """The environment of a ROS program in `domain`, on this host alone."""
    given = {key: str(value) for key, value in more.items()}
    return {**variables(), **in_domain(domain), **given}


def lacking() -> str:
    """Why nothing with rclpy can run here; "" if it can."""
    try:
        python()
    except EnvironmentLackingError as error:
        return str(error)
    return ""
