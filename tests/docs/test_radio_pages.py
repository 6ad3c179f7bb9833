"""The pages about radios, from first to last command, on test radios that imitate them."""

import contextlib
import os
import shutil
import subprocess
import sys
import time
import uuid
from pathlib import Path

import pytest

from sdrlinkd.process import Process, wait_until
from tests.docs.pages import commands_of, missing_words
from tests.soapy_loopback import Bus, missing, module_folder

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "docs" / "radios"
NOT_HERE = ("sudo ", "make setup", "export PATH", "hackrf_info")
"""Needs root, or a real HackRF; or it has been done."""
MAY_SAY_NO = ("sdrlinkctl doctor", "sdrlinkctl status", "sdrlinkctl plan")
"""Commands with an exit code that depends on this machine and its air."""
ASKED_AGAIN = ("sdrlinkctl status",)
"""Commands to repeat until they show enough: robots need time to discover each other."""
PATIENCE_S = 240

pytestmark = [
    pytest.mark.skipif(bool(missing()), reason=missing()),
    pytest.mark.slow,
    pytest.mark.timeout(900),
]


class Laptop:
    """A folder, a radio and sockets of its own."""

    def __init__(self, folder, unit, bus, driver, model):
        self.folder = folder
        self._driver = driver
        self.device = f"driver=loopback,model={model},bus={bus},unit={unit}"
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
        """Type a command; returns the screen. A command with `&` continues to run."""
        line = command.line.replace(self._driver, self.device)
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
            path.write_text(path.read_text().replace(f'"{self._driver}"', f'"{self.device}"'))
        return done.stdout

    def _leave_running(self, line, shown):
        process = Process(
            ["/bin/sh", "-c", f"exec {line}"], name=line, environment=self.environment,
            folder=self.folder,
        )  # fmt: skip
        self._behind.append(process)
        process.start()
        wait_until(lambda: not missing_words(shown, process.log()), PATIENCE_S, process)
        return process.log()

    def close(self):
        """End what still runs, the last one first: cleanly, and without a traceback."""
        for process in reversed(self._behind):
            process.stop(within_s=30)
            assert "Traceback" not in process.log(), process.log()


@contextlib.contextmanager
def laptops(folder, driver, model):
    """`first` and `second`, on one air."""
    name = f"page-{uuid.uuid4().hex[:12]}"
    with Bus(name), contextlib.ExitStack() as stack:
        made = {}
        for unit, who in enumerate(("first", "second")):
            made[who] = Laptop(folder / who, unit, name, driver, model)
            stack.callback(made[who].close)
        yield made


def walk(page, typists, default=""):
    """Type every command of a page, as `default` if it names no typist; returns their number."""
    run = 0
    for command in commands_of((PAGES / page).read_text()):
        named = command.who or default
        if command.line.startswith(NOT_HERE):
            continue
        assert named, f"who types this? {command.line}"
        for who in typists if named == "both" else [named]:
            screen, until = typists[who].type(command), time.monotonic() + PATIENCE_S
            while missing_words(command.shown, screen) and command.line.startswith(ASKED_AGAIN):
                assert time.monotonic() < until, screen
                screen = typists[who].type(command)
            assert "Traceback" not in screen
            assert not missing_words(command.shown, screen), screen
            run += 1
        if command.line.startswith("sdrlinkctl init"):
            # "Copy the folder to the second laptop."
            first, second = typists["first"], typists["second"]
            shutil.copytree(first.folder / "team", second.folder / "team")
            copied = second.folder / "team" / "robot_2.toml"
            copied.write_text(copied.read_text().replace(first.device, second.device))
    return run


def test_the_hackrf_page_works_and_shows_what_is_printed(tmp_path):
    with laptops(tmp_path, "driver=hackrf", "hackrf") as both:
        assert walk("hackrf.md", both) >= 14


def test_the_usrp_page_works_and_shows_what_is_printed(tmp_path):
    with laptops(tmp_path, "driver=uhd", "usrp") as both:
        assert walk("usrp.md", both, default="first") >= 3


def test_words_that_are_not_on_the_screen_are_missed():
    assert missing_words(("SNR 33 dB", "…"), "SNR 7 dB") == {}
    assert missing_words(("registry same",), "registry differs") == {"registry same": ["same"]}
