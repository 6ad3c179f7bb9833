"""Runs with real daemons: in lock-step they repeat to the byte, and nothing is left behind."""

import os
import signal
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import msgspec
import pytest

from sdrlinkd.client import Subscriber
from sdrlinkd.errors import UserError
from sdrlinkd.lab import LabOptions, load_scenario, run_lab
from sdrlinkd.process import Process, module, wait_until
from tests.lab.scenarios import processes_of, write_scenario

MESSAGES = 15
"""What each robot sends: 1.5 s of velocity commands at 10 Hz."""


@pytest.fixture(scope="module")
def temporary(tmp_path_factory):
    """The folder for temporary files, for this test alone."""
    folder = tmp_path_factory.mktemp("lab")
    was, tempfile.tempdir = tempfile.tempdir, str(folder)
    yield folder
    tempfile.tempdir = was


@pytest.fixture(scope="module")
def run_small(temporary):
    """Runs a small scenario; returns its report and everything shown."""

    def run(name="run", **parts):
        folder = temporary / name
        folder.mkdir(exist_ok=True)
        path = write_scenario(folder, **parts)
        states = []
        return run_lab(LabOptions(path, load_scenario(path), None, None), states.append), states

    return run


@pytest.fixture
def nothing_left(temporary):
    """Checks at the end that nothing is left behind."""
    yield
    assert list(temporary.glob("sdrlink-*")) == []
    assert processes_of(temporary) == []


@pytest.fixture(scope="module")
def runs(run_small):
    """Three simultaneous runs, so that the scheduling differs between them."""
    seeds = {"first": 1, "again": 1, "other": 2}
    with ThreadPoolExecutor(len(seeds)) as pool:
        found = {
            name: pool.submit(run_small, name, top=f"seed = {seed}\n")
            for name, seed in seeds.items()
        }
        return {name: each.result() for name, each in found.items()}


@pytest.mark.slow
def test_all_arrives_both_ways_unchanged_and_the_ledgers_add_up(runs, nothing_left):
    report, states = runs["first"]
    assert (report.scenario, report.title) == ("small", "Two small robots")
    assert (report.pace, report.seed, report.duration_s) == ("lockstep", 1, 1.5)
    assert [(pair.sender, pair.receiver) for pair in report.pairs] == [(1, 2), (2, 1)]
    for pair in report.pairs:
        assert (pair.sent, pair.received, pair.pdr) == (MESSAGES, MESSAGES, 1.0)
        assert pair.bytes_identical
        assert pair.pdr_tenths == [1.0] * 10
        assert pair.topics == {"cmd_vel": [MESSAGES, MESSAGES]}
        # A burst, and at most a few rounds of slots before it.
        assert 5 < pair.latency_ms["p50"] < pair.latency_ms["max"] < 100
    assert (report.pdr, report.worst_pdr) == (1.0, 1.0)
    assert [robot.id for robot in report.robots] == [1, 2]
    for robot in report.robots:
        assert robot.ledger_adds_up
        assert (robot.dropped, robot.left, robot.samples_lost) == ({}, 0, 0)
        assert (robot.pdus_bad, robot.headers_bad, robot.bursts_failed) == (0, 0, 0)
        assert robot.access.startswith("tdma: 2 slots")
        assert robot.pdus_sent >= MESSAGES
        assert 0 < robot.airtime_share < 0.5
    assert [state.until_s for state in states] == [2.0] * len(states)
    assert states[-1].now_s == 2.0
    assert [state.now_s for state in states] == sorted(state.now_s for state in states)
    for snapshot in states[-1].snapshots:
        assert snapshot.link.tx.accepted == snapshot.link.tx.sent == MESSAGES


@pytest.mark.slow
def test_the_same_seed_gives_the_same_report_to_the_byte(runs):
    (first, _), (again, _) = runs["first"], runs["again"]
    assert msgspec.json.encode(again) == msgspec.json.encode(first)


@pytest.mark.slow
def test_another_seed_gives_another_run(runs):
    (first, _), (other, _) = runs["first"], runs["other"]
    assert (first.seed, other.seed, other.pdr) == (1, 2, 1.0)
    assert [robot.snr_db for robot in other.robots] != [robot.snr_db for robot in first.robots]


@pytest.mark.long
def test_a_daemon_that_cannot_start_tells_why(run_small, nothing_left):
    with pytest.raises(UserError) as error:
        run_small(extra="slot_s = 1e-4\n")
    for part in ("the daemon has no link", "access.slot_s: got 0.0001", "allowed: at least"):
        assert part in str(error.value)
    assert "Traceback" not in str(error.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"extra": '[outages]\ntrace = "a.jsonl"\n'}, ["a.jsonl", "--traces"]),
        ({"extra": "[daemon.link]\npdu_size = 5\n"}, ["small.toml", "link.pdu_size", "got 5"]),
        ({"robots": '[[robot]]\nid = 1\ntopics = ["none"]\n'}, ["topics", "/none", "allowed"]),
    ],
)
def test_a_scenario_that_cannot_be_run_tells_why(run_small, nothing_left, parts, says):
    with pytest.raises(UserError) as error:
        run_small(**parts)
    for part in says:
        assert part in str(error.value)
    assert "sdrlink-ether --dir" not in str(error.value), "nobody is to start a hub by hand"


@pytest.mark.slow
@pytest.mark.parametrize("nth", [1, 3], ids=["the hub", "the second daemon"])
def test_an_interrupt_while_a_process_starts_leaves_none(run_small, nothing_left, monkeypatch, nth):
    """The interrupt comes when the process runs but is not registered yet."""
    started = []

    def start(*arguments, **options):
        started.append(subprocess.Popen(*arguments, **options))
        if len(started) == nth:
            signal.raise_signal(signal.SIGINT)
        return started[-1]

    stand_in = SimpleNamespace(
        Popen=start, PIPE=subprocess.PIPE, TimeoutExpired=subprocess.TimeoutExpired
    )
    monkeypatch.setattr("sdrlinkd.process.subprocess", stand_in)
    try:
        with pytest.raises(KeyboardInterrupt):
            run_small()
        assert len(started) == nth
        assert [process.poll() is None for process in started] == [False] * nth
    finally:
        for process in started:
            process.kill()
            process.wait()


@pytest.mark.long
def test_a_lab_that_is_interrupted_leaves_nothing_behind(tmp_path_factory):
    folder = tmp_path_factory.mktemp("end")
    path = write_scenario(folder, pace="realtime")
    arguments = ("lab", path, "--out", folder / "out", "--duration", "600")
    command, environment = module("sdrlinkd.cli", *arguments), {**os.environ, "TMPDIR": str(folder)}
    with Process(command, environment=environment) as lab:
        wait_until(lambda: len(list(folder.glob("sdrlink-*/robot_*/ctl.sock"))) == 2, 60, lab)
        for robot in folder.glob("sdrlink-*/robot_*"):
            with Subscriber(directory=robot, timeout_s=60) as heard:
                assert heard.receive(60)
        assert len(processes_of(folder)) == 4
        code = lab.stop(signal.SIGINT, 60)
    assert code == 130, lab.log()
    assert "Traceback" not in lab.log()
    assert processes_of(folder) == []
    assert list(folder.glob("sdrlink-*")) == []
