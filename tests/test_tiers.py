"""The suite itself: it runs where SIGINT is ignored, and reports skipped tests in one line."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.machine import lacks, left_out

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
