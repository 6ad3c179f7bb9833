"""docs/radios/hackrf.md from its first to its last command, on a radio that is like a HackRF."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import uuid
from pathlib import Path

import pytest

from tests.docs.pages import commands_of, missing_words
from tests.soapy_loopback import Bus, missing, module_folder
from tests.waiting import wait_for

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "radios" / "hackrf.md"
NOT_HERE = ("sudo ", "make setup", "export PATH", "hackrf_info")
"""Needs root, or a HackRF of metal; or it has been done."""
MAY_SAY_NO = ("sdrlinkctl doctor", "sdrlinkctl status", "sdrlinkctl plan")
"""Their exit code is about this machine and its air."""
PATIENCE_S = 240

pytestmark = [
    pytest.mark.skipif(bool(missing()), reason=missing()),
    pytest.mark.slow,
    pytest.mark.timeout(900),
]


class Laptop:
    """A folder, a radio and sockets of its own."""

    def __init__(self, folder, unit, bus):
        self.folder = folder
        self.device = f"driver=loopback,model=hackrf,bus={bus},unit={unit}"
        self.environment = os.environ | {
            "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
            "SDRLINKD_RUNTIME_DIR": str(folder / "run"),
            "SOAPY_SDR_PLUGIN_PATH": str(module_folder()),
            "SOAPY_SDR_ROOT": "/nonexistent",
            "COLUMNS": "100",
        }
        self._behind = []
        folder.mkdir()

    def type(self, command):
        """What is on the screen then; a command behind `&` is left running."""
        line = command.line.replace("driver=hackrf", self.device)
        if command.runs_on:
            return self._leave_running(line.removesuffix("&"), command.shown)
        done = subprocess.run(
            line, shell=True, cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=PATIENCE_S,
            check=False,
        )  # fmt: skip
        allowed = (0, 1) if line.startswith(MAY_SAY_NO) else (0,)
        assert done.returncode in allowed, f"{line}\n{done.stdout}"
        for path in self.folder.glob("team/*.toml"):
            path.write_text(path.read_text().replace('"driver=hackrf"', f'"{self.device}"'))
        return done.stdout

    def _leave_running(self, line, shown):
        log = self.folder / f"log{len(self._behind)}"
        with log.open("wb") as out:
            process = subprocess.Popen(
                f"exec {line}", shell=True, cwd=self.folder, env=self.environment,
                stdin=subprocess.DEVNULL, stdout=out, stderr=out,
            )  # fmt: skip
        self._behind.append((process, log))

        def is_shown():
            assert process.poll() is None, log.read_text()
            return not missing_words(shown, log.read_text())

        wait_for(is_shown, PATIENCE_S)
        return log.read_text()

    def close(self):
        """Ends what was left running, the last first: in good order, and without a traceback."""
        for process, log in reversed(self._behind):
            process.send_signal(signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(30)
            process.kill()
            process.wait()
            assert "Traceback" not in log.read_text(), log.read_text()


@pytest.fixture
def laptops(tmp_path):
    """`first` and `second`, on one air."""
    name = f"page-{uuid.uuid4().hex[:12]}"
    with Bus(name), contextlib.ExitStack() as stack:
        made = {
            who: Laptop(tmp_path / who, unit, name) for unit, who in enumerate(("first", "second"))
        }
        for each in made.values():
            stack.callback(each.close)
        yield made


def test_every_command_of_the_page_works_and_shows_what_is_printed(laptops):
    run = 0
    for command in commands_of(PAGE.read_text()):
        if not command.who:
            assert command.line.startswith(NOT_HERE), f"who types this? {command.line}"
            continue
        for who in laptops if command.who == "both" else [command.who]:
            screen = laptops[who].type(command)
            assert "Traceback" not in screen
            assert not missing_words(command.shown, screen), screen
            run += 1
        if command.line.startswith("sdrlinkctl init"):
            # "Copy the folder to the second laptop."
            shutil.copytree(laptops["first"].folder / "team", laptops["second"].folder / "team")
            copied = laptops["second"].folder / "team" / "robot_2.toml"
            text = copied.read_text().replace(laptops["first"].device, laptops["second"].device)
            copied.write_text(text)
    assert run >= 14


def test_words_that_are_not_on_the_screen_are_missed():
    assert missing_words(("SNR 33 dB", "…"), "SNR 7 dB") == {}
    assert missing_words(("registry same",), "registry differs") == {"registry same": ["same"]}
