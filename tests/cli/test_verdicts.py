"""What scripts get from `status`: the exit code, bare fields, CSV; and nothing of a restart."""

import contextlib
import os
import pty
import re
import signal
import subprocess
import sys
import threading

import msgspec
import pytest

from sdrlinkd.cli import run
from sdrlinkd.cli.following import Follower
from sdrlinkd.reports import VerdictReport
from tests.cli.snapshots import SNAPSHOT
from tests.waiting import wait_for

LEAVES_SCREEN = "\x1b[?1049l"
ENTERS_SCREEN = "\x1b[?1049h"


@pytest.fixture
def told(monkeypatch, capsys):
    """Runs `status` on a snapshot; (exit code, stdout, stderr)."""

    def call(snapshot, *arguments):
        monkeypatch.setattr("sdrlinkd.cli.status.ask_status", lambda _: snapshot)
        monkeypatch.setattr("sdrlinkd.cli.status.connect", lambda _: contextlib.nullcontext())
        code = run(["status", *arguments])
        return code, *capsys.readouterr()

    return call


def judged(level, *reasons):
    verdict = VerdictReport(level=level, reasons=[*reasons])
    return msgspec.structs.replace(SNAPSHOT, verdict=verdict)


@pytest.mark.parametrize("form", [(), ("-q",), ("--json",), ("--all",), ("--field", "node")])
@pytest.mark.parametrize(("level", "code"), [("OK", 0), ("DEGRADED", 1), ("DOWN", 3)])
def test_the_exit_code_is_the_verdict(told, level, code, form):
    got, out, err = told(judged(level, "no radio since 12 s"), *form)
    assert (got, err) == (code, "")
    assert (out == "") == (form == ("-q",))


def test_no_daemon_is_4_and_wrong_usage_2(tmp_path, capsys):
    assert run(["status", "-q", "--runtime-dir", str(tmp_path)]) == 4
    assert capsys.readouterr() == ("", "")
    assert run(["status", "--runtime-dir", str(tmp_path)]) == 4
    assert "no sdrlinkd answers" in capsys.readouterr().err
    for wrong in (("-q", "--watch"), ("--json", "--csv"), ("--loud",)):
        assert run(["status", *wrong]) == 2


@pytest.mark.parametrize(("field", "value"), [
    ("verdict.level", "DEGRADED"), ("link.tx.sent", "110"), ("tx.sent", "110"),
    ("topics.odom.sent", "60"), ("topics./robot_1/odom.sent", "60"), ("topics.1.sent", "60"),
    ("received.odom.pdr", str(100 / 103)), ("neighbors.2.snr_db", "17.25"),
    ("neighbors.1.snr_db", ""), ("carrier.state", "up"), ("link.control_channel", "true"),
    ("link.tx.dropped", '{"tx_bad_envelope":1,"tx_expired":5}'),
    ("link.mcs_changes.0", "[3.5,2,3]"),
    ("link.bursts_by_mcs.3", "10"), ("notices.0", SNAPSHOT.notices[0]),
])  # fmt: skip
def test_a_field_is_printed_bare(told, field, value):
    _, out, _ = told(SNAPSHOT, "--field", field)
    assert out == value + "\n"


def test_fields_come_line_by_line_or_as_csv(told):
    wanted = ("--field", "node", "--field", "namespace", "--field", "verdict.reasons.1")
    _, out, _ = told(SNAPSHOT, *wanted)
    assert out.splitlines() == ["1", "robot_1", "robot 2 hears us at 3 dB, 4 % lost"]
    _, out, _ = told(SNAPSHOT, *wanted, "--csv")
    assert out.splitlines() == [
        "node,namespace,verdict.reasons.1", '1,robot_1,"robot 2 hears us at 3 dB, 4 % lost"',
    ]  # fmt: skip
    _, out, _ = told(SNAPSHOT, "--csv")
    head, line = out.splitlines()
    assert "link.air_sent_pct" in head
    assert head.count(",") == line.count(",")


@pytest.mark.parametrize(("field", "says"), [
    ("link.tx.snt", "no snt in link.tx; did you mean sent?"),
    ("topics.oodm.sent", "did you mean odom?"),
    ("neighbors.7.snr_db", "no 7 in link.neighbors; allowed: 1, 2"),
    ("node.x", "no fields in node"),
    ("link.topics.99", "no 99 in link.topics"),
])  # fmt: skip
def test_a_field_that_is_not_there_is_refused(told, field, says):
    code, out, err = told(SNAPSHOT, "--field", field)
    assert (code, out) == (2, "")
    assert says in err


def test_a_follower_waits_for_a_daemon_that_is_restarted(start_daemon):
    daemon = start_daemon()
    with Follower(daemon.directory) as follower:
        assert follower.look().node == 1
        assert daemon.stop(within_s=20) == 0
        assert follower.look() is None
        assert f"waiting for sdrlinkd in {daemon.directory} (" in follower.waiting
        daemon.start()
        wait_for(lambda: follower.look() is not None)


class Terminal:
    """A command in a terminal of 80 x 24, with everything it has written."""

    def __init__(self, *arguments):
        ours, theirs = pty.openpty()
        size = {"LINES": "24", "COLUMNS": "80", "TERM": "xterm-256color"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "sdrlinkd.cli", *map(str, arguments)],
            stdin=theirs, stdout=theirs, stderr=subprocess.STDOUT, env={**os.environ, **size},
            start_new_session=True,
        )  # fmt: skip
        os.close(theirs)
        self.text, self._fd = "", ours
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self):
        # A closed other end is an input error here.
        with contextlib.suppress(OSError):
            while data := os.read(self._fd, 65536):
                self.text += data.decode(errors="replace")

    def shows(self, text):
        """Whether the text was on the screen at any time, apart from colours and cursor moves."""
        return text in re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", self.text)

    def press(self, keys):
        os.write(self._fd, keys.encode())

    def end(self):
        """The exit code of the command."""
        code = self.process.wait(30)
        self._reader.join(10)
        os.close(self._fd)
        return code


@pytest.mark.slow
@pytest.mark.parametrize(("way", "code"), [("q", 0), ("\x03", 0), (signal.SIGTERM, 143)])
def test_top_leaves_the_terminal_as_it_was(daemon, way, code):
    terminal = Terminal("top", "--runtime-dir", daemon.directory)
    wait_for(lambda: terminal.shows("/robot_1/odom"), 60)
    if isinstance(way, str):
        terminal.press(way)
    else:
        terminal.process.send_signal(way)
    assert terminal.end() == code
    assert terminal.text.rfind(LEAVES_SCREEN) > terminal.text.rfind(ENTERS_SCREEN) >= 0
    assert "Traceback" not in terminal.text


def test_a_watch_waits_for_a_daemon_that_is_restarted(start_daemon):
    daemon = start_daemon()
    terminal = Terminal("status", "--watch", "--runtime-dir", daemon.directory)
    wait_for(lambda: terminal.shows("0 in = 0 sent"), 60)
    assert daemon.stop(within_s=20) == 0
    wait_for(lambda: terminal.shows("waiting for sdrlinkd in"))
    before = len(terminal.text)
    daemon.start()
    wait_for(lambda: "sent + " in terminal.text[before:])
    terminal.process.send_signal(signal.SIGINT)
    assert terminal.end() == 130
    assert terminal.text.rfind(LEAVES_SCREEN) > terminal.text.rfind(ENTERS_SCREEN) >= 0
    assert "Traceback" not in terminal.text


def test_top_needs_a_terminal(capsys):
    assert run(["top"]) == 2
    assert "status --watch" in capsys.readouterr().err
