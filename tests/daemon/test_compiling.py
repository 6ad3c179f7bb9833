"""Daemons and compiled code: nothing is compiled while a link runs, and a cold start says so."""

import signal
from pathlib import Path

import pytest

import phy
from sdrlinkd import compiling
from sdrlinkd.client import Publisher
from sdrlinkd.compiling import compile_modem, tell_progress
from tests.waiting import wait_for

COMPILED = phy.Engine("compiled", "compiled for x86-64", {}, None, None)
NUMPY = COMPILED._replace(name="numpy", told="NumPy, which is slow: no compiler")


def test_a_daemon_without_a_compiled_modem_takes_messages_says_so_and_can_be_stopped(
    start_daemon, tmp_path, monkeypatch
):
    """Its radio is opened after the compilation."""
    # In the daemon's process and in that of its modem.
    (tmp_path / "sitecustomize.py").write_text(
        "from pathlib import Path\nfrom phy.testing import files\n"
        f"files.folders = lambda: iter([Path({str(tmp_path / 'cold')!r})])\n"
    )
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{Path(phy.__file__).parents[1]}")
    daemon = start_daemon(
        f'drain_s = 0\nbackend = "iqfile"\n[iqfile]\ntransmit = "{tmp_path / "radio"}"\n'
    )
    wait_for(lambda: "compiling the modem, once: " in daemon.log(), timeout_s=60)
    with Publisher(daemon.directory) as out:
        out.send("/robot_1/odom", b"\0\1\0\0odom")
    wait_for(lambda: "compiling the modem, once" in daemon.snapshot().carrier.reason)
    snapshot = daemon.snapshot()
    assert snapshot.verdict.level == "DOWN"
    assert snapshot.link.tx.queued == 1
    assert not list(tmp_path.glob("radio*"))
    # A reload restarts the opening, but not the compilation, and nobody has to wait for it.
    daemon.send_signal(signal.SIGHUP)
    wait_for(lambda: "re-read: " in daemon.log())
    assert daemon.is_up()
    assert "compiling the modem, once" in daemon.snapshot().carrier.reason
    assert daemon.stop(within_s=60) == 0
    assert "compiled the modem in" not in daemon.log()


@pytest.fixture
def told(monkeypatch):
    """What is logged about a warm-up that compiles kernels at these times."""

    def call(times, used=COMPILED, **options):
        clock = iter([0.0, *times, times[-1] if times else 0.0])
        monkeypatch.setattr(compiling.time, "monotonic", lambda: next(clock))

        def warm_up(_, progress):
            for done in range(len(times)):
                progress(done + 1, len(times))
            return used

        monkeypatch.setattr(phy, "warm_up", warm_up)
        said = []
        compile_modem(said.append, **options)
        return said

    return call


def test_progress_is_told_now_and_then(told):
    assert told([0.5, 1.0, 9.0, 10.6, 30.0, 31.0]) == [
        "compiling the modem, once: 1 of 6 steps, 0 s so far",
        "compiling the modem, once: 4 of 6 steps, 11 s so far",
        "compiling the modem, once: 5 of 6 steps, 30 s so far",
        "compiled the modem in 31 s",
    ]


def test_a_compilation_that_failed_halfway_is_not_told_as_done():
    said = []

    def fail(progress):
        progress(1, 3)
        return "NumPy"

    assert tell_progress(fail, said.append) == "NumPy"
    assert [line.partition(",")[0] for line in said] == ["compiling the modem"]


def test_of_a_compiled_modem_nothing_is_told(told):
    assert told([]) == []


def test_a_screen_shows_progress_elsewhere(told):
    passing = []
    assert told([0.5, 1.0], every_s=0.1, passing=passing.append) == ["compiled the modem in 1 s"]
    assert len(passing) == 2


def test_a_modem_that_is_not_compiled_is_told_unless_it_was_asked_for(told):
    (line,) = told([], NUMPY)
    assert line.startswith("the modem runs on NumPy, which is slow: no compiler; to compile it: ")
    assert told([], NUMPY, engine="numpy") == []


def test_it_can_be_given_up(told):
    class GivenUpError(Exception):
        """The caller that waited for the warm-up has gone."""

    def stop(done, total):
        if done == 2:
            raise GivenUpError(total)

    with pytest.raises(GivenUpError, match="3"):
        told([0.5, 1.0, 2.0], watch=stop)
