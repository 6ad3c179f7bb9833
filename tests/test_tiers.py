"""The suite itself: its tiers are enforced, and no test hangs, hides or leaves anything."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cost import descendants
from tests.laws import USUAL
from tests.machine import lacks, left_out
from tests.tiers import Cost, kept, too_dear

ROOT = Path(__file__).parents[1]
CONFTEST = """
from tests import tiers
from tests.tiers import *
from tests.watchdog import Limits
tiers.MOST_S.update(quick=0.3, slow=0.8)
tiers.SLOW_MACHINE = 1.0
tiers.slowness = lambda: 1.0
tiers.USUAL_LIMITS = Limits(cpu_s=1.0, idle_s=2.0, wall_s=6.0)
"""
FAULTS = """
import subprocess, sys, time
import pytest

def burn(seconds):
    begin = time.process_time()
    while time.process_time() < begin + seconds: pass

SLEEPER = [sys.executable, "-c", "import time; time.sleep(100)"]

@pytest.fixture(scope="module")
def shared():
    burn(0.5)

def test_good(): pass
def test_what_is_shared_is_not_charged(shared): pass
def test_dear(): burn(0.5)
def test_dear_by_a_child():
    burning = "import time\\nwhile time.process_time() < 0.5: pass"
    subprocess.run([sys.executable, "-c", burning])
def test_endless(): burn(50)
def test_idle(): time.sleep(100)
def test_ticking():
    while True: time.sleep(0.1); burn(0.005)
@pytest.mark.skip(reason="no moon")
def test_needs_a_moon(): pass
def test_leaves(): subprocess.Popen(SLEEPER)
"""
STUBBORN = """
import contextlib
from tests import watchdog
watchdog.LAST_WORDS_S = 0.5

def test_stubborn():
    while True:
        with contextlib.suppress(BaseException):
            while True: pass
"""
IGNORING = ("sh", "-c", "trap '' INT; exec \"$@\"", "sh")


def test_interrupts_reach_tests():
    assert signal.getsignal(signal.SIGINT) == signal.default_int_handler


@pytest.mark.slow
def test_interrupts_reach_tests_of_a_caller_who_ignores_them():
    """Shells start background jobs that way."""
    name = f"{__file__}::{test_interrupts_reach_tests.__name__}"
    done = subprocess.run(
        [*IGNORING, *(sys.executable, "-m", "pytest", "-p", "no:cacheprovider"), name],
        cwd=Path(__file__).parents[1], capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "1 passed" in done.stdout


def test_what_is_left_out_is_told_in_one_line():
    assert left_out([]) == ""
    assert left_out([lacks("g++", "libsoapysdr-dev")]) == (
        "1 test needs system packages (apt-get install g++ libsoapysdr-dev)"
    )
    reasons = [
        lacks("gnuradio"),
        "needs root, for namespaces",
        lacks("g++"),
        lacks("g++"),
        "no air",
    ]
    assert left_out(reasons) == (
        "3 tests need system packages (apt-get install g++ gnuradio); 1 test needs root; "
        "1 skipped: no air"
    )


def run_of(folder, faults):
    """A run of its own in `folder`, of the items in `faults`."""
    (folder / "conftest.py").write_text(CONFTEST)
    (folder / "test_faults.py").write_text(faults)
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-c", os.devnull, "-p", "no:cacheprovider",
         "--rootdir", folder, "-W", "ignore", folder],
        env={**os.environ, "PYTHONPATH": str(ROOT), "SDRLINK_TRIALS": str(USUAL)},
        cwd=folder, capture_output=True, text=True, check=False, timeout=200,
    )  # fmt: skip


@pytest.mark.slow
def test_an_item_that_cannot_be_interrupted_is_named_as_the_run_ends(tmp_path):
    """Such as one that searches for the smallest case that fails, and takes this for one."""
    done = run_of(tmp_path, STUBBORN)
    assert done.returncode == 1
    assert "test_stubborn computes for too long: " in done.stderr


@pytest.mark.slow
def test_a_run_ends_in_time_and_names_each_item_that_is_at_fault(tmp_path):
    done = run_of(tmp_path, FAULTS)
    out = done.stdout
    assert done.returncode == 1, out + done.stderr
    said = {
        "test_dear": "tier quick allows 0.3 s: make it cheaper, or mark it `slow`",
        "test_dear_by_a_child": "or mark it `",
        # On a busy machine, the clock may come first.
        "test_endless": " too long: ",
        "test_idle": "it hangs: idle for",
        "test_ticking": "it takes too long",
        "test_leaves": "processes are left behind by test_faults.py::test_leaves: ",
    }
    for name, words in said.items():
        at = [part for part in out.split("\n_____") if f" {name} " in part.partition("\n")[0]]
        assert any(words in part for part in at), (name, out)
    assert "test_good" not in out.partition("short test summary")[2]
    assert "charged" not in out.partition("short test summary")[2]
    assert "skipped: test_faults.py::test_needs_a_moon" in out
    assert "1 skipped: no moon" in out
    assert "9 items" in out


@pytest.mark.parametrize(
    ("cost", "allowed", "mark"),
    [
        (Cost("quick", 1.0), 1, ""),
        (Cost("quick", 1.1), 1, "`slow`"),
        (Cost("quick", 1.1), 3, ""),
        (Cost("quick", 11.0), 1, "`long`"),
        (Cost("quick", 0.1, 9.0), 1, ""),
        (Cost("slow", 9.0), 1, ""),
        (Cost("slow", 11.0), 1, "`long`"),
        (Cost("realtime", 11.0), 1, "`long`"),
        (Cost("realtime", 11.0, most_s=20), 1, ""),
        (Cost("realtime", 21.0, most_s=20), 1, "`long`"),
        (Cost("long", 1e4), 1, ""),
    ],
)
def test_a_tier_has_a_limit(cost, allowed, mark):
    complaint = too_dear(cost, allowed)
    assert mark in complaint
    assert bool(mark) == bool(complaint)


def test_the_table_of_tiers_gets_the_row_of_its_command():
    text = "before\n\n| `make quick` | old |\n| `make test` | old |\n\nafter\n"
    assert kept(text, "make quick", [("quick", 7, 1.5), ("long", 1, 20.0)], 31.2, 12.3, 1.26) == (
        "before\n\n| `make quick` | 7 (2 CPU s) | – | – | 1 (20 CPU s) | 31 | 12 | 1.3 |\n"
        "| `make test` | old |\n\nafter\n"
    )


def test_processes_may_end_while_they_are_counted():
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    assert list(descendants(process.pid)) == []
