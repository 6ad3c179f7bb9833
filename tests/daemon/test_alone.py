"""A daemon without a configuration: one robot that hears itself, for a first look."""

import os
import signal

import pytest

from sdrlinkd import __main__ as program
from sdrlinkd.client import ControlClient, Publisher, Subscriber
from sdrlinkd.process import Process, module
from tests.waiting import wait_for

CDR = b"\0\1\0\0"


def test_the_hosts_configuration_comes_first_and_a_service_has_one(tmp_path, monkeypatch):
    usual = program._usual  # noqa: SLF001  # what no option names
    monkeypatch.delenv("INVOCATION_ID", raising=False)
    host = tmp_path / "sdrlinkd.toml"
    monkeypatch.setattr(program, "DEFAULT_CONFIG", host)
    assert usual().name == "alone.toml"
    host.write_text("")
    assert usual() == host
    host.unlink()
    monkeypatch.setenv("INVOCATION_ID", "1")
    assert usual() == host


@pytest.mark.realtime
def test_it_hears_what_it_sends_and_says_how_it_came_to_be(tmp_path):
    run = "import sys; from pathlib import Path; from sdrlinkd import __main__ as program; "
    run += f"program.DEFAULT_CONFIG = Path({str(tmp_path / 'none.toml')!r}); program.main([])"
    environment = {**os.environ, "RUNTIME_DIRECTORY": str(tmp_path)}
    environment.pop("INVOCATION_ID", None)
    command = [module("sdrlinkd")[0], "-c", run]
    with Process(command, environment=environment, log=tmp_path / "log") as daemon:
        wait_for(lambda: "the loopback is up" in daemon.log())
        assert "without a configuration: robot 1 alone, which hears itself" in daemon.log()
        with (
            Subscriber("/rx_robot_1/*", runtime_dir=tmp_path) as heard,
            Publisher(tmp_path) as out,
        ):
            out.send("/robot_1/odom", CDR)
            message = heard.receive(20)
        assert (message.topic, message.payload) == ("/rx_robot_1/odom", CDR)
        with ControlClient(tmp_path) as control, Subscriber("/rx_robot_1/a", runtime_dir=tmp_path):
            # What consumers here want of this robot itself is demand, as a ROS bridge needs.
            control.ask("declare", {"name": "/robot_1/a", "type": "std_msgs/msg/String"})
            wait_for(lambda: control.ask("demand", {})["wanted"] == {"/robot_1/a": [1]})
        daemon.send_signal(signal.SIGTERM)
        assert daemon.wait() == 0
