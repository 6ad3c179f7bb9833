"""A bridge beside robot 2, which hears robot 1 over an air; a client of Foxglove's protocol."""

import contextlib

import pytest

from tests.conftest import daemons
from tests.pairs import pair
from tests.programs import sdrlinkctl

DRIVEN = "/robot_1/cmd_*"
"""What the bridge lets people at Foxglove send."""

SETTINGS = 'registry = ""\ntopic.cmd_vel.lifespan_s = inf\n'
"""A command would be too old after 0.3 s, which a busy machine needs to draw breath."""


def bridge_to(daemon, *arguments):
    """A bridge beside a daemon, not started yet."""
    at = ("--runtime-dir", daemon.directory, "--listen", "127.0.0.1:0")
    return sdrlinkctl("bridge", "foxglove", *at, *arguments)


def url_of(bridge):
    """Where a bridge listens, from its first line."""
    return bridge.line().split()[-1]


class Team:
    """Robots 1 and 2, without a registry, and the address of the bridge beside robot 2."""

    def __init__(self, robots, url):
        self.sender, self.seen = robots
        self.url = url

    def declare(self, name, kind, **more):
        """Declare a topic of robot 1."""
        with self.sender.control() as control:
            control.ask("declare", {"name": f"/robot_1/{name}", "type": kind, **more})


@pytest.fixture(scope="module")
def team(tmp_path_factory):
    """One team for all tests of a module."""
    with contextlib.ExitStack() as stack:
        start = stack.enter_context(daemons(tmp_path_factory))
        hub = tmp_path_factory.mktemp("hub")
        robots = stack.enter_context(pair(start, hub, SETTINGS))
        bridge = stack.enter_context(bridge_to(robots[1], "--publish", DRIVEN))
        yield Team(robots, url_of(bridge))
        assert "Traceback" not in bridge.log(), bridge.log()
