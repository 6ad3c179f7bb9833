"""`topic hz|bw|delay`, `list` and what TAB knows, with a real daemon; and the arithmetic alone."""

import json
import os
import re
import signal
from pathlib import Path

import pytest

from sdrlinkd.adapters import empty, to_cdr
from sdrlinkd.cli import main, run
from sdrlinkd.cli.spans import Bandwidth, Delay, Rate
from sdrlinkd.client import Publisher
from sdrlinkd.process import Process, module, wait_until
from tests.programs import sdrlinkctl
from tests.waiting import again_and_again, wait_for

ODOM = "/robot_1/odom"
HEARD = "/rx_robot_1/odom"
KIND = "nav_msgs/msg/Odometry"
ROOT = Path(__file__).parents[2]


def fed(measure, times, sizes=(), ages=()):
    for at, time_s in enumerate(times):
        measure.add(time_s, sizes[at] if sizes else 0, ages[at] if ages else None)
    return measure.lines()


def test_the_rate_reads_as_that_of_ros():
    assert fed(Rate(100), [0.0]) == []
    assert fed(Rate(100), [0.0, 0.1, 0.3]) == [
        "average rate: 6.667", "\tmin: 0.100s max: 0.200s std dev: 0.05000s window: 2",
    ]  # fmt: skip
    assert fed(Rate(2), [0.0, 9.0, 9.5, 10.0])[0] == "average rate: 2.000"


def test_bandwidth_counts_from_the_first_message():
    assert fed(Bandwidth(100), [0.0], [5]) == []
    assert fed(Bandwidth(100), [0.0, 1.0, 2.0], [999, 1500, 2500]) == [
        "2.00 KB/s from 3 messages", "\tMessage size mean: 1.67 KB min: 999 B max: 2.50 KB",
    ]  # fmt: skip


def test_delay_leaves_out_what_it_does_not_know():
    assert fed(Delay(10), [0, 1], ages=[None, None]) == ["2 messages of unknown age"]
    assert fed(Delay(10), [0, 1, 2], ages=[0.25, None, 0.75]) == [
        "average delay: 0.500", "\tmin: 0.250s max: 0.750s std dev: 0.25000s window: 2",
        "1 messages of unknown age",
    ]  # fmt: skip


def measuring(daemon, *arguments):
    """Output of `topic …`, run while messages come until it ends."""
    message = to_cdr(empty(KIND), KIND)
    with (
        sdrlinkctl("topic", *arguments, "--runtime-dir", daemon.directory) as topic,
        Publisher(daemon.directory) as out,
    ):
        again_and_again(lambda: out.send(ODOM, message), while_=lambda: topic.is_running)
    assert topic.code == 0, topic.err()
    return topic.out(), len(message)


@pytest.mark.parametrize(("what", "pattern"), [
    ("hz", r"average rate: \d+\.\d{3}\n\tmin: \S+s max: \S+s std dev: \S+s window: 49\n"),
    ("bw", r"\S+ [KM]?B/s from 50 messages\n\tMessage size mean: 708 B min: 708 B max: 708 B\n"),
    ("delay", r"average delay: \d\.\d{3}\n\tmin: \S+s max: \S+s std dev: \S+s window: 50\n"),
])  # fmt: skip
@pytest.mark.slow
def test_a_topic_heard_is_measured(daemon, what, pattern):
    told, size = measuring(daemon, what, HEARD, "--count", "50")
    assert size == 708
    assert re.search(HEARD + r": 50 messages in \d+\.\d s\n" + pattern + "$", told), told


def test_ctrl_c_ends_with_a_summary(start_daemon):
    daemon = start_daemon()
    with sdrlinkctl("topic", "hz", HEARD, "--runtime-dir", daemon.directory) as topic:
        # It reports a second without any message.
        assert topic.line() == "no new messages"
        assert topic.stop(signal.SIGINT) == 130
    assert f"{HEARD}: 0 messages in" in topic.out()
    assert "Traceback" not in topic.err()


def test_what_is_not_heard_is_told(daemon, capsys):
    there = ("--runtime-dir", str(daemon.directory))
    assert run(["topic", "hz", ODOM, *there]) == 2
    assert "this robot sends it; received topics have names such as" in capsys.readouterr().err
    assert run(["topic", "bw", "/rx_robot_9/odom", "--duration", "0.05", *there]) == 2
    assert "no message received" in capsys.readouterr().err


def test_list_finds_a_daemon_wherever_its_directory_is(start_daemon, capsys):
    daemon = start_daemon()
    assert run(["list", "--json"]) == 0
    found = {each["runtime_dir"]: each for each in json.loads(capsys.readouterr().out)}
    mine = found[str(daemon.directory)]
    assert (mine["node"], mine["namespace"], mine["backend"]) == (1, "robot_1", "direct")
    assert mine["pid"] == daemon.pid
    assert run(["list"]) == 0
    assert str(daemon.pid) in capsys.readouterr().out
    assert daemon.stop(within_s=20) == 0
    run(["list", "--json"])
    assert str(daemon.directory) not in capsys.readouterr().out


@pytest.mark.slow
def test_list_finds_a_directory_that_is_named_from_where_the_daemon_was_started(
    tmp_path, write_config, capsys
):
    config = write_config(tmp_path).read_text().replace(f'"{tmp_path}"', '"here"')
    (tmp_path / "relative.toml").write_text(config)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = module("sdrlinkd", "--config", "relative.toml")

    def is_listed():
        run(["list", "--json"])
        found = json.loads(capsys.readouterr().out)
        return str(tmp_path / "here") in {each["runtime_dir"] for each in found if each["node"]}

    with Process(command, environment=environment, folder=tmp_path) as daemon:
        wait_until(is_listed, 20, daemon)
        assert daemon.stop() == 0


@pytest.fixture
def completed(monkeypatch, capsys):
    """What bash is offered behind the last of these words."""

    def ask(words, directory):
        monkeypatch.setenv("COMP_WORDS", words)
        monkeypatch.setenv("COMP_CWORD", str(words.count(" ")))
        monkeypatch.setenv("_SDRLINKCTL_COMPLETE", "complete_bash")
        monkeypatch.setenv("SDRLINKD_RUNTIME_DIR", str(directory))
        with pytest.raises(SystemExit):
            main()
        return capsys.readouterr().out.split()

    return ask


@pytest.mark.slow
def test_tab_knows_live_names(daemon, completed):
    with Publisher(daemon.directory) as out:
        out.send(ODOM, to_cdr(empty(KIND), KIND))
    wait_for(lambda: daemon.snapshot().link.received != [])
    for words, there in (
        ("sdrlinkctl set /robot_1/o", ["/robot_1/odom"]),
        ("sdrlinkctl set /robot_1/odom --qos ", ["urgent", "latency", "default", "bulk"]),
        ("sdrlinkctl pub /robot_1/cm", ["/robot_1/cmd_vel"]),
        ("sdrlinkctl pub x --dst ", ["255"]),
        ("sdrlinkctl echo /rx", [HEARD]),
        ("sdrlinkctl topic hz /rx", [HEARD]),
        ("sdrlinkctl latency /rx", [HEARD]),
        ("sdrlinkctl status --field link.tx.se", ["link.tx.sent"]),
        ("sdrlinkctl status --field verd", ["verdict"]),
        ("sdrlinkctl status --field tx.bursts_s", ["tx.bursts_sent"]),
    ):
        assert completed(words, daemon.directory) == there, words


@pytest.mark.slow
def test_tab_is_silent_where_there_is_no_daemon(tmp_path, completed):
    assert completed("sdrlinkctl set /rob", tmp_path) == []
