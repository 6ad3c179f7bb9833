"""Daemons that end and come back while a program continues."""

import pytest

from tests.programs import Daemon
from tests.waiting import wait_for


@pytest.fixture
def spawn_again():
    """Start a new daemon in the folder of an ended one; does not wait for it."""
    started = []

    def spawn(daemon):
        log = daemon.directory / f"log{len(started) + 2}"
        started.append(Daemon(daemon.directory, daemon.config, log))
        started[-1].start()
        return started[-1]

    yield spawn
    for daemon in started:
        daemon.ends_well(20)


@pytest.fixture
def stop():
    """Stop a daemon cleanly."""

    def end(daemon):
        assert daemon.stop() == 0

    return end


@pytest.fixture
def restart(stop, spawn_again):
    """Stop a daemon, and wait until another one answers in its folder."""

    def again(daemon):
        stop(daemon)
        running = spawn_again(daemon)
        wait_for(running.is_up)
        return running

    return again
