"""A reader at a computer, who types what a page prints and looks at the screen."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

from sdrlinkd.process import Process, wait_until
from tests.docs.pages import ROOT, missing_words

PATIENCE_S = 240
ASKED_AGAIN = ("sdrlinkctl status", "sdrlinkctl latency")
"""Commands that a reader repeats while the screen shows too little: robots take time to meet."""


class Reader:
    """A folder, a shell and sockets of their own; `replaced` maps words of the page to words here.

    `may_say_no` are commands whose exit code depends on this machine and its air.
    """

    def __init__(self, folder, replaced=(), may_say_no=(), environment=()):
        self.folder = folder
        self._replaced = dict(replaced)
        self._may_say_no = tuple(may_say_no)
        self.environment = os.environ | {
            "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
            "PYTHONPATH": str(ROOT),
            "SDRLINKD_RUNTIME_DIR": str(folder / "run"),
            "XDG_STATE_HOME": str(folder / "state"),
            "COLUMNS": "100",
            **dict(environment),
        }
        self._behind = []
        folder.mkdir(exist_ok=True)

    def see(self, command):
        """Type a command until the screen has the words shown below it; the last screen."""
        until = time.monotonic() + PATIENCE_S
        while True:
            screen, code = self.type(command)
            is_allowed = code == 0 or (code == 1 and command.line.startswith(self._may_say_no))
            if is_allowed and not missing_words(command.shown, screen):
                break
            if not command.line.startswith(ASKED_AGAIN) or time.monotonic() > until:
                break
        assert is_allowed, f"{command.line}: exit code {code}\n{screen}"
        assert "Traceback" not in screen, screen
        assert "internal error" not in screen, screen
        assert not missing_words(command.shown, screen), f"{command.line}\n{screen}"
        return screen

    def type(self, command):
        """What the screen shows, and the exit code; a command that ends in `&` keeps running."""
        line = command.line
        for word, here in self._replaced.items():
            line = line.replace(word, here)
        if line.startswith("export "):
            name, _, value = line.removeprefix("export ").partition("=")
            self.environment[name] = value
            return "", 0
        if command.runs_on:
            return self.leave_running(line.removesuffix("&").strip(), command.shown), 0
        done = subprocess.run(
            line, shell=True, cwd=self.folder, env=self.environment, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=PATIENCE_S,
            check=False,
        )  # fmt: skip
        return done.stdout, done.returncode

    def leave_running(self, line, shown=()):
        """Start a program in the background; its log once the words shown are in it."""
        process = Process(
            ["/bin/sh", "-c", f"exec {line}"], name=shlex.split(line)[0],
            environment=self.environment, folder=self.folder,
        )  # fmt: skip
        self._behind.append(process)
        process.start()
        wait_until(lambda: not missing_words(shown, process.log()), PATIENCE_S, process)
        return process.log()

    def copy(self, folder, to):
        """Copy a folder to another reader's computer."""
        shutil.copytree(self.folder / folder, to.folder / folder)

    def wait_for(self, word, pattern):
        """The log of a program in the background, once it has `pattern`."""
        process = self.behind(word)
        wait_until(lambda: re.search(pattern, process.log()), PATIENCE_S, process)
        return process.log()

    def behind(self, word):
        """The program in the background whose name has `word`."""
        return next(each for each in reversed(self._behind) if word in each.name)

    def close(self):
        """End what still runs, the last first: in good order, and without a traceback."""
        for process in reversed(self._behind):
            process.stop(within_s=30)
            assert "Traceback" not in process.log(), process.log()
        self._behind.clear()
