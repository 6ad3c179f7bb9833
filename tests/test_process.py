"""Programs as separate processes: their output is kept, and none is left behind."""

import os
import signal
import sys
import textwrap
import time
from pathlib import Path

import pytest

from sdrlinkd.process import Process, ProcessError, module, wait_until
from tests.waiting import wait_for

DEAF = "signal.signal(signal.SIGTERM, signal.SIG_IGN)"


def program(code, **more):
    """Python code with the imports of these tests, as a program."""
    head = "import os, signal, subprocess, sys, time\n"
    return Process([sys.executable, "-u", "-c", head + textwrap.dedent(code)], **more)


def is_there(pid):
    return Path(f"/proc/{pid}").exists() and " Z " not in Path(f"/proc/{pid}/stat").read_text()


def test_output_and_errors_are_kept_and_lines_come_one_by_one():
    with program("print('one'); print('two', file=sys.stderr); print('three')") as process:
        assert [process.line(), process.line()] == ["one", "three"]
        assert process.wait() == process.code == 0
    assert (process.out(), process.err()) == ("one\nthree\n", "two\n")
    assert process.log() == "one\nthree\ntwo\n"


def test_all_that_it_says_is_in_its_log(tmp_path):
    with program("print(1); print(2, file=sys.stderr)", log=tmp_path / "log") as process:
        process.wait()
    assert process.log() == process.out() == (tmp_path / "log").read_text() == "1\n2\n"


def test_a_log_begins_anew_with_a_process_and_goes_on_when_it_is_started_again(tmp_path):
    (tmp_path / "log").write_text("of another one\n")
    process = program("print(1)", log=tmp_path / "log")
    for said in ("1\n", "1\n1\n"):
        with process:
            process.wait()
        assert process.log() == said


def test_what_it_is_told_it_reads_and_the_end_of_its_input_too():
    with program("print(*(line.strip() for line in sys.stdin))") as process:
        process.tell("a")
        process.tell("b")
        process.close_input()
        assert process.line() == "a b"


@pytest.mark.parametrize(("code", "says"), [
    ("sys.exit('no radio')", "it has ended: no radio"),
    ("sys.exit(3)", "it has ended: no output, exit code 3"),
    ("print('half', end=''); sys.exit(3)", "it has ended: half"),
    ("os.kill(os.getpid(), 9)", "it has ended: no output, exit code -9"),
])  # fmt: skip
def test_who_ends_without_a_line_is_quoted(code, says):
    with program(code, name="it") as process, pytest.raises(ProcessError) as error:
        process.line()
    assert str(error.value) == says


def test_what_is_said_at_last_counts():
    """Even if the process has ended before anyone reads it."""
    with program("print('last')") as process:
        process.wait()
        assert process.line() == "last"


def test_nobody_waits_for_ever():
    with program("print('still here'); time.sleep(60)", name="it") as process:
        process.line()
        with pytest.raises(ProcessError, match=r"timed out after 0\.05 s; it: still here"):
            process.line(0.05)
        with pytest.raises(ProcessError, match=r"it: did not finish within 0\.05 s"):
            process.wait(0.05)
        begun = time.monotonic()
    assert time.monotonic() - begun < 10
    assert process.code == -signal.SIGTERM


def test_who_does_not_read_any_more_is_quoted():
    with program("sys.stdin.close(); os.close(0); sys.exit('deaf')") as process:
        process.wait()
        with pytest.raises(ProcessError, match="deaf"):
            process.tell("x")


def test_a_condition_that_holds_ends_the_wait_and_a_dead_process_does():
    with program("time.sleep(60)") as living, program("sys.exit('oh')", name="it") as dead:
        wait_until(lambda: True, 0.0, dead)
        with pytest.raises(ProcessError, match="it has ended: oh"):
            wait_until(lambda: False, 20.0, living, dead)


def test_a_stop_is_asked_for_then_made_sure_of():
    with program(f"{DEAF}; print('.'); time.sleep(60)") as process:
        process.line()
        assert process.stop(within_s=0.1) == -signal.SIGKILL
    with program("time.sleep(60)") as process:
        assert process.stop(signal.SIGKILL) == -signal.SIGKILL
    assert program("").stop() is None


def test_a_kill_takes_all_that_it_has_started():
    code = """
    below = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    print(below.pid)
    time.sleep(60)
    """
    with program(code) as process:
        below = int(process.line())
        assert is_there(below)
        process.kill()
    wait_for(lambda: not is_there(below))


@pytest.mark.slow
@pytest.mark.parametrize("of", ["sdrlinkd", "sdrlinkd.cli"])
def test_programs_of_ours_end_with_who_started_them(of, tmp_path, write_config):
    """Even if the parent was killed."""
    arguments = ("--config", str(write_config(tmp_path)))
    if of == "sdrlinkd.cli":
        arguments = ("demo", "--link", "direct", "--duration", "60")
    starter = f"""
    from sdrlinkd.process import Process, module
    process = Process(module({of!r}, *{arguments!r}), log={str(tmp_path / "log")!r})
    process.start()
    print(process.pid)
    time.sleep(60)
    """
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    with program(starter, environment=environment) as process:
        pid = int(process.line())
        wait_for(lambda: list(tmp_path.glob("**/ctl.sock")), 60)
        assert is_there(pid)
        process.send_signal(signal.SIGKILL)
        process.wait()
    wait_for(lambda: not is_there(pid), 60)


def test_a_module_runs_by_our_own_interpreter():
    with Process(module("json.tool", "--help")) as process:
        assert process.wait() == 0
    assert "usage" in process.out()
