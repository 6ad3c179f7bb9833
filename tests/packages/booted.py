"""A Debian in a folder that runs, with a systemd of its own as its first process."""

import contextlib
import os
import shlex
import shutil
import signal
import subprocess
from pathlib import Path

from tests.packages.debian import PATIENCE_S, Debian, call
from tests.waiting import wait_for

SYSTEMD = ("systemd", "systemd-sysv")
"""Packages without which it does not boot."""
BOOT_S = 120.0
STOP_S = 60.0


class Booted:
    """The system `debian`, which has SYSTEMD; it shares the network with this host."""

    def __init__(self, debian: Debian) -> None:
        self._log = debian.path.with_suffix(".log")
        with self._log.open("wb") as log:
            self._nspawn = subprocess.Popen(
                [
                    "systemd-nspawn", "--register=no", "--keep-unit", "--boot", "--console=pipe",
                    f"--machine=sdrlink-{os.getpid()}", f"--directory={debian.path}",
                ],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log,
            )  # fmt: skip
        self._init = 0

    def wait(self) -> None:
        """Wait until it has booted."""
        wait_for(self._has_init, BOOT_S)
        # Whether all units of Debian like to run here is not our concern.
        booted = ("running", "degraded")
        wait_for(lambda: self.answer("systemctl is-system-running") in booted, BOOT_S)

    def run(self, line: str) -> str:
        """Output of a line that root types; it must succeed."""
        return call(*self._entered(line))

    def answer(self, line: str) -> str:
        """What a line prints, without the last newline, also if it fails."""
        done = subprocess.run(
            self._entered(line), stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            stdin=subprocess.DEVNULL, text=True, check=False, timeout=PATIENCE_S,
        )  # fmt: skip
        return done.stdout.rstrip("\n")

    def stop(self) -> None:
        """Shut it down."""
        self._nspawn.send_signal(signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._nspawn.wait(STOP_S)
        self._nspawn.kill()
        self._nspawn.wait()

    def _has_init(self) -> bool:
        assert self._nspawn.poll() is None, self._log.read_text(errors="replace")
        children = Path(f"/proc/{self._nspawn.pid}/task/{self._nspawn.pid}/children").read_text()
        # There is a helper first, and it is a copy of systemd-nspawn.
        found = [each for each in children.split() if _name(each) == "systemd"]
        self._init = int(found[0]) if found else 0
        return bool(found)

    def _entered(self, line: str) -> list[str]:
        spaces = ("--mount", "--uts", "--ipc", "--net", "--pid", "--cgroup", "--root", "--wd")
        clean = ("env", "-i", "PATH=/usr/sbin:/usr/bin:/sbin:/bin", "LANG=C.UTF-8", "HOME=/root")
        return ["nsenter", f"--target={self._init}", *spaces, *clean, "sh", "-e", "-c", line]


def lacking() -> str:
    """The Debian package without which none can be booted here; "" if one can."""
    return "" if shutil.which("systemd-nspawn") else "systemd-container"


def as_user(user: str, line: str) -> str:
    """A line for root that does as if `user` typed `line`."""
    return f"setpriv --reuid={user} --regid={user} --init-groups sh -c {shlex.quote(line)}"


def _name(pid: str) -> str:
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/comm").read_text().strip()
    return ""
