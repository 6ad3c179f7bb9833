"""Simulations of `benchmarks.team` in several processes: the same rows, and no process is left."""

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from benchmarks import absent
from benchmarks.absent import PeerError
from benchmarks.team import turnaround_rows
from benchmarks.team.runs import Runs, all_of, results

ROOT = Path(__file__).parents[1]


@pytest.fixture(autouse=True)
def nothing_told():
    absent.forget()


def power(base, exponent):
    return base**exponent


def fail(error):
    raise error


@pytest.mark.slow
@pytest.mark.parametrize("processes", [1, 2, 5])
def test_results_come_to_those_that_asked(processes):
    with Runs(processes) as runs:
        asked = [runs.add(f"{i}", 7 * i % 5, partial(power, i, 2)) for i in range(12)]
        assert all_of(asked[::-1]) == [i * i for i in reversed(range(12))]


def test_the_longest_begin_first_and_all_is_told(capfd):
    with Runs(1) as runs:
        asked = [runs.add(f"run {cost}", cost, partial(power, cost, 1)) for cost in (2, 9, 5)]
        all_of(asked)
    told = [line.split(",")[0] for line in capfd.readouterr().err.splitlines()]
    assert told == ["1 of 3: run 9", "2 of 3: run 5", "3 of 3: run 2"]


def test_one_that_fails_or_dies_costs_itself(capfd):
    with Runs(2) as runs:
        peers = {
            "good": runs.add("good", 1, partial(power, 2, 3)),
            "dead": runs.add("dead", 3, partial(os._exit, 7)),
            "bad": runs.add("bad", 2, partial(fail, PeerError("has no air"))),
            "odd": runs.add("odd", 2, partial(partial, lambda: 0)),
        }
        ours = runs.add("ours", 0, partial(fail, KeyError("a bug")))
        assert results(peers) == {"good": 8}
        with pytest.raises(KeyError, match="a bug"):
            ours.result()
    told = capfd.readouterr().err
    assert "not measured: dead: its process ended with 7" in told
    assert "not measured: bad: has no air" in told
    assert "not measured: odd: " in told


def test_after_an_interrupt_none_is_left():
    def interrupted():
        with Runs(2) as runs:
            for _ in range(3):
                runs.add("long", 1, partial(time.sleep, 600))
            runs.add("short", 2, partial(power, 1, 1)).result()
            assert len(multiprocessing.active_children()) == 1
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert multiprocessing.active_children() == []


@pytest.mark.long
def test_rows_are_the_same_however_many_processes_there_are(monkeypatch):
    monkeypatch.setattr(turnaround_rows, "QUICK_S", 3.0)
    found = []
    for processes in (1, 3):
        with Runs(processes) as runs:
            found.append([*turnaround_rows.rows(runs, 5, True)])
    assert found[0] == found[1]
    assert len(found[0]) == 2
    with Runs(2) as runs:
        assert found[0] != [*turnaround_rows.rows(runs, 6, True)], "the seed counts"


@pytest.mark.long
def test_the_benchmark_can_be_interrupted():
    command = [sys.executable, "-m", "benchmarks.team", "--quick", "--json", "--processes", "2"]
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    ) as benchmark:  # fmt: skip
        assert benchmark.stderr.readline().startswith("1 of 49: ")
        os.killpg(benchmark.pid, signal.SIGINT)
        out, told = benchmark.communicate(timeout=200)
    assert json.loads(out)["benchmark"] == "team"
    assert benchmark.returncode == 2
    assert "Traceback" not in told
    with pytest.raises(ProcessLookupError):
        os.killpg(benchmark.pid, 0)
