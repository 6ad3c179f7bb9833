"""Daemons and commands that begin as copies of a process that has loaded their program already.

Loading takes a processor ten times as long as all the rest of a start. The fork server of
multiprocessing would load the main module of the test run into each copy. A test that sets
variables of the interpreter or of the linker gets a process that loads everything itself.
"""

import atexit
import contextlib
import gc
import json
import os
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

ORIGIN = (
    "import runpy, sys; from tests.copied import serve; name, *sys.argv[1:] = serve(); "
    "runpy.run_module(name, run_name='__main__', alter_sys=True)"
)
OF_A_TEST = {"PYTEST_CURRENT_TEST", "SDRLINK_TEST_RUN"}
"""Without these variables, no test has left the origin behind."""
READ_AT_THE_START = ("PYTHON", "LD_")
MOST_OCTETS = 65536
MOST_FILES = 1024


class Copy:
    """A process as a subprocess.Popen shows it. Its status comes through a pipe."""

    def __init__(self, name: str, status: int, stdin: int) -> None:
        self.name = name
        self._status = os.fdopen(status, "rb", buffering=0)
        self.stdin = os.fdopen(stdin, "wb")
        self.pid = int(self._status.readline())
        self.returncode: int | None = None
        self.test = os.environ.get("PYTEST_CURRENT_TEST", "no test").rpartition(" ")[0]

    def poll(self) -> int | None:
        """The exit code, or minus the signal that ended it; None while it runs."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.wait(0)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end. Raises TimeoutExpired."""
        if self.returncode is None:
            with selectors.DefaultSelector() as waiting:
                waiting.register(self._status, selectors.EVENT_READ)
                if not waiting.select(timeout):
                    raise subprocess.TimeoutExpired(self.name, timeout or 0)
            self.returncode = int(self._status.readline() or -signal.SIGKILL)
            self._status.close()
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send it a signal, unless it has ended."""
        if self.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self.pid, number)


class Origin:
    """The process of which others are copies; it is started when it is needed."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._server: socket.socket | None = None
        self._copies: list[Copy] = []
        self._environment = {k: v for k, v in os.environ.items() if k not in OF_A_TEST}

    def popen(
        self, command: list[str], *, env: Mapping[str, str], cwd: Path | None, stdout: int,
        stderr: int, **more: Any,
    ) -> "Copy | subprocess.Popen[bytes]":  # fmt: skip
        """As subprocess.Popen with a pipe as stdin, for `python -m NAME ARGUMENTS`."""
        if _at_the_start(env) != _at_the_start(self._environment):
            return subprocess.Popen(command, env=env, cwd=cwd, stdout=stdout, stderr=stderr, **more)
        server = self.loaded()
        stdin, to_it = os.pipe()
        status, from_it = os.pipe()
        told = json.dumps([str(cwd or Path.cwd()), dict(env), *command[2:]])
        socket.send_fds(server, [told.encode()], [stdin, stdout, stderr, from_it])
        os.close(stdin)
        os.close(from_it)
        copy = Copy(command[2], status, to_it)
        with self._lock:
            self._copies = [each for each in self._copies if each.poll() is None] + [copy]
        return copy

    def loaded(self) -> socket.socket:
        """Its socket, once it has loaded the program."""
        with self._lock:
            if self._server is None:
                self._server, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
                with theirs:
                    process = subprocess.Popen(
                        [sys.executable, "-c", ORIGIN], stdin=theirs, env=self._environment
                    )
                self._server.recv(1)
                # Last registered, first called: it ends when nobody can talk to it any more.
                atexit.register(process.wait)
                atexit.register(self._server.close)
            return self._server

    def left(self) -> Iterator[tuple[int, str, str]]:
        """Each copy that runs: id, test that began it, command."""
        for each in self._copies:
            if each.poll() is None:
                yield each.pid, each.test, each.name


origin = Origin()


def _at_the_start(environment: Mapping[str, str]) -> dict[str, str]:
    return {k: v for k, v in environment.items() if k.startswith(READ_AT_THE_START)}


def serve() -> list[str]:
    """Fork for each message on stdin; returns in the child, with the module and its arguments."""
    _load()
    server = socket.socket(fileno=os.dup(0))
    waiting = selectors.DefaultSelector()
    waiting.register(server, selectors.EVENT_READ)
    server.send(b"!")
    while True:
        for key, _ in waiting.select():
            if key.data is not None:
                _reap(waiting, key)
                continue
            told, files, *_ = socket.recv_fds(server, MOST_OCTETS, 4)
            if not told:
                sys.exit()
            *streams, status = files
            pid = os.fork()
            if not pid:
                waiting.close()
                server.close()
                return _become(told, streams)
            for stream in streams:
                os.close(stream)
            _tell(status, pid)
            waiting.register(os.pidfd_open(pid), selectors.EVENT_READ, (pid, status))


def _become(told: bytes, streams: list[int]) -> list[str]:
    """Take what the message says in place of what was copied."""
    os.setsid()
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
    # What the origin holds of other copies.
    os.closerange(3, MOST_FILES)
    folder, environment, *command = json.loads(told)
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    sys.path[0] = folder
    tempfile.tempdir = None
    return command


def _reap(waiting: selectors.BaseSelector, key: selectors.SelectorKey) -> None:
    """Tell who waits how a copy has ended."""
    pid, status = key.data
    waiting.unregister(key.fd)
    os.close(key.fd)
    _tell(status, os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
    os.close(status)


def _tell(status: int, number: int) -> None:
    with contextlib.suppress(BrokenPipeError):
        os.write(status, b"%d\n" % number)


def _load() -> None:
    """What a daemon loads in any case, and what a command does."""
    import uvloop  # noqa: F401

    from sdrlinkd import daemon  # noqa: F401
    from sdrlinkd.adapters import knows
    from sdrlinkd.cli import app  # noqa: F401

    knows("std_msgs/msg/Header")
    gc.freeze()
