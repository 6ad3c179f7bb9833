"""Fixtures of the tests with real ROS 2 nodes."""

import os
from collections.abc import Callable, Iterator

import pytest

from tests.ros.programs import Agent, Bridge
from tests.ros.wheels import REQUIRED, python


@pytest.fixture(scope="session")
def ros() -> None:
    """Skip, with the reason, where there is no rclpy."""
    try:
        python()
    except (RuntimeError, OSError) as error:
        if os.environ.get(REQUIRED) == "1":
            raise
        pytest.skip(str(error))


@pytest.fixture
def start(ros: None) -> Iterator[Callable[..., Agent | Bridge]]:
    """Starts agents and bridges, and stops them."""
    started: list[Agent | Bridge] = []

    def start_(kind: type, *arguments: object) -> Agent | Bridge:
        started.append(kind(*arguments))
        return started[-1]

    yield start_
    for each in reversed(started):
        each.end()
