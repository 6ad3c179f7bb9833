"""Rows with radios that vanish or stall, and with disks that are full."""

import signal
import time

import pytest

from sdrlinkd.client import Publisher
from sdrlinkd.process import Process, module
from tests.lab.scenarios import write_scenario
from tests.programs import sdrlinkctl
from tests.scorecard.helpers import CDR, Counting, problems
from tests.waiting import wait_for

pytestmark = pytest.mark.long


def hub(folder):
    """A simulated air, as a program."""
    scenario = write_scenario(folder.parent, pace="realtime")
    command = module("sdrlinkd.cli.ether", scenario, "--dir", folder)
    return Process(command, name="sdrlink-ether")


def on_air(folder, robot):
    return (
        f'namespace = "robot_{robot}"\nbackend = "ether"\n[ether]\ndir = "{folder}"\n'
        "[modem]\nrate_hz = 1e6\n"
    )


def through(out, heard, within_s=20.0):
    """Send until something new is heard."""
    before, began = heard.count, time.monotonic()
    while heard.count == before:
        assert time.monotonic() - began < within_s, "nothing is heard"
        out.send("/robot_1/odom", CDR + bytes(60), lifespan_ms=1000)
        time.sleep(0.05)
    return time.monotonic() - began


def test_rows_10_and_11_the_radio_vanishes_and_stalls(start_daemon, tmp_path, seconds, figure):
    folder, worst_s, times = tmp_path / "air", 0.0, max(1, int(seconds / 10))
    with hub(folder):
        one, two = (start_daemon(on_air(folder, robot)) for robot in (1, 2))
        for each in (one, two):
            wait_for(lambda each=each: each.snapshot().carrier.state == "up", 60)
    for _ in range(times):
        for each in (one, two):
            wait_for(lambda each=each: each.snapshot().carrier.state != "up", 30)
        with (
            hub(folder) as air, Counting(two.directory, "/rx_robot_1/*") as heard,
            Publisher(one.directory) as out,
        ):  # fmt: skip
            began = time.monotonic()
            for each in (one, two):
                wait_for(lambda each=each: each.snapshot().carrier.state == "up", 60)
            worst_s = max(worst_s, time.monotonic() - began)
            through(out, heard)
            air.send_signal(signal.SIGSTOP)
            stalled = time.monotonic()
            while time.monotonic() - stalled < 2:
                assert one.is_up(), "the daemon answers all the same"
            air.send_signal(signal.SIGCONT)
            after_s = through(out, heard)
    assert problems(one) == problems(two) == []
    figure(10, "the radio vanishes and returns", f"{times} times, up again within {worst_s:.1f} s")
    figure(11, "the radio stalls for 2 s", f"the daemon answers; heard again after {after_s:.1f} s")


def test_row_12_the_disk_is_full(start_daemon, tmp_path, figure):
    daemon = start_daemon('backend = "loopback"\n[modem]\nrate_hz = 1e6\n')
    wait_for(lambda: daemon.snapshot().carrier.state == "up", 60)
    (tmp_path / "rec.sigmf-data").symlink_to("/dev/full")
    command = sdrlinkctl(
        "record", tmp_path / "rec", "--dir", daemon.directory, "--force", "--duration", "5"
    )
    with command as recording:
        code = recording.wait(60)
        assert code == 2, recording.log()
    assert daemon.is_up()
    assert problems(daemon) == []
    figure(12, "the disk is full", f"recording stops with exit code {code}; the link goes on")
