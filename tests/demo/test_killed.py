"""A killed demonstration or lab leaves no process, and the next run can reuse its folder."""

import signal
import sys

import pytest

from sdrlinkd.demo import run_folder
from sdrlinkd.process import Process, wait_until
from tests.lab.scenarios import processes_of, write_scenario
from tests.programs import sdrlinkctl
from tests.waiting import wait_for


@pytest.fixture
def killed(tmp_path, tmp_path_factory, monkeypatch):
    """Run a command until `is_up(folder of its run)`, then kill it; returns that folder."""
    # A short name, because the folder contains sockets.
    temporary = tmp_path_factory.mktemp("k")
    monkeypatch.setenv("TMPDIR", str(temporary))

    def call(is_up, *arguments):
        with sdrlinkctl(*arguments, folder=tmp_path) as process:
            wait_until(lambda: is_up(temporary), 120, process)
            assert len(processes_of(temporary)) > 0
            process.send_signal(signal.SIGKILL)
            process.wait()
        return temporary

    return call


def sockets(temporary):
    return list(temporary.glob("sdrlink-*/*/ctl.sock"))


@pytest.mark.slow
@pytest.mark.parametrize("command", ["demo", "lab"])
def test_no_process_is_left_and_the_next_run_removes_the_folder(
    killed, tmp_path, command, monkeypatch
):
    if command == "demo":
        arguments, n_daemons = ["--link", "ofdm", "--rate", "1e6", "--duration", "60"], 1
    else:
        arguments, n_daemons = [write_scenario(tmp_path, pace="realtime"), "--duration", 600], 2
    temporary = killed(lambda at: len(sockets(at)) == n_daemons, command, *arguments)
    (left,) = temporary.glob("sdrlink-*")
    wait_for(lambda: not processes_of(temporary), 60)
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    with run_folder() as folder:
        assert not left.exists()
        assert list(temporary.glob("sdrlink-*")) == [folder]
        with run_folder() as other:
            # A folder in use is not removed.
            assert folder.exists()
            assert other != folder
    assert list(temporary.glob("sdrlink-*")) == []


def test_what_is_not_of_a_run_is_left_alone(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    (tmp_path / "sdrlink-ether").mkdir()
    (tmp_path / "sdrlink-bench-1").mkdir()
    (tmp_path / "sdrlink-dead").mkdir()
    (tmp_path / "sdrlink-dead" / "run.lock").write_text("")
    with run_folder():
        assert {each.name for each in tmp_path.iterdir()} > {"sdrlink-ether", "sdrlink-bench-1"}
        assert not (tmp_path / "sdrlink-dead").exists()


def test_a_daemon_that_does_not_stop_is_killed_in_the_end(tmp_path):
    """Its parent is gone, so nothing else would stop it."""
    code = (
        "import signal, sdrlinkd.parent as parent; parent.STOP_S = 0.1;"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN); parent.end_with_parent();"
        "print('.', flush=True); signal.pause()"
    )
    with Process([sys.executable, "-c", code]) as process:
        process.line()
        process.close_input()
        assert process.wait(20) == -signal.SIGKILL
