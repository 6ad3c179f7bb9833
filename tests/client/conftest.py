"""Daemons that end and come back while a program goes on."""

import pytest

from tests.programs import Daemon
from tests.waiting import wait_for


@pytest.fixture
def spawn_again():
    """Starts one more daemon in the folder of one that has ended; does not wait for it."""
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
    """Ends a daemon in peace."""

    def end(daemon):
        assert daemon.stop() == 0

    return end


@pytest.fixture
def restart(stop, spawn_again):
    """Ends a daemon and waits until another one answers in its folder."""

    def again(daemon):
        stop(daemon)
        running = spawn_again(daemon)
        wait_for(running.is_up)
        return running

    return again
