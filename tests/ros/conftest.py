"""Fixtures of the tests with real ROS 2 nodes."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.backends.hubs import serving
from tests.daemon.ether import AIR
from tests.ros.programs import Agent, Bridge
from tests.ros.wheels import REQUIRED, lacking


@pytest.fixture(scope="session")
def ros() -> None:
    """Skip, with the reason, where there is no rclpy."""
    if reason := lacking():
        assert os.environ.get(REQUIRED) != "1", reason
        pytest.skip(reason)


@pytest.fixture(scope="module")
def hub(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The folder of a hub with a clear air."""
    folder = tmp_path_factory.mktemp("hub")
    with serving(folder, **AIR, snr_db=30.0):
        yield folder


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
