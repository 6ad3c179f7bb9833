"""Copies of a loaded program differ from processes that load it in nothing but their start."""

import os
import signal
from pathlib import Path

import pytest

from sdrlinkd import __version__
from tests.programs import sdrlinkctl, sdrlinkd
from tests.waiting import wait_for

pytestmark = pytest.mark.slow


def command_line(process):
    """What the kernel shows of it."""
    return Path(f"/proc/{process.pid}/cmdline").read_text()


def test_what_it_says_and_how_it_ends_are_its_own(tmp_path):
    with sdrlinkd("--version") as told, sdrlinkd("--config", "none.toml", folder=tmp_path) as lost:
        assert (told.wait(), lost.wait()) == (0, 2)
    assert (told.out(), told.err()) == (f"sdrlinkd {__version__}\n", "")
    assert lost.err().startswith("sdrlinkd: none.toml: cannot be read")


@pytest.mark.parametrize("changes", [{}, {"PYTHONUTF8": "1"}])
def test_it_ends_by_signals_and_with_its_parent(daemon, changes):
    """One with variables of its own for the interpreter is no copy."""
    environment = {**os.environ, **changes}
    watch = ("status", "--watch", "--runtime-dir", daemon.directory)
    with sdrlinkctl(*watch, environment=environment) as killed:
        wait_for(killed.out)
        assert ("tests.copied" in command_line(killed)) == (not changes)
        killed.kill()
        assert killed.code == -signal.SIGKILL
    with sdrlinkctl(*watch, environment=environment) as orphan:
        wait_for(orphan.out)
        orphan.close_input()
        assert orphan.wait() != 0
