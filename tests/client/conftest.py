"""Daemons that end and come back while a program goes on."""

import subprocess
import sys

import pytest

from tests.conftest import Running
from tests.waiting import wait_for


@pytest.fixture
def spawn_again():
    """Starts one more daemon in the folder of one that has ended; does not wait for it."""
    started = []

    def spawn(daemon):
        log_path = daemon.directory / f"log{len(started) + 2}"
        with log_path.open("wb") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "sdrlinkd", "--config", str(daemon.config)],
                stdout=log, stderr=log,
            )  # fmt: skip
        started.append(Running(process, daemon.directory, daemon.config, log_path))
        return started[-1]

    yield spawn
    for running in started:
        running.process.terminate()
        code = running.process.wait(20)
        assert "Traceback" not in running.log(), running.log()
        assert code == 0, running.log()


@pytest.fixture
def stop():
    """Ends a daemon in peace."""

    def end(daemon):
        daemon.process.terminate()
        assert daemon.process.wait(20) == 0

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
