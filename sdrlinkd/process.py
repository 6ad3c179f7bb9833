"""Child processes: start them, wait for them, stop them, and leave none behind."""

import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Self, cast

from sdrlinkd import parent

STOP_TIMEOUT_S = 20.0
PATIENCE_S = 60.0
LOOK_S = 0.01
"""Polling interval in s while waiting for a process."""
NOT_STARTED = -1
"""File descriptor of a process that was not started."""


class ProcessError(Exception):
    """A process did not do what was awaited; the message holds its name and its last output."""


def module(name: str, *arguments: object) -> list[str]:
    """The command line that runs a Python module with our own interpreter."""
    return [sys.executable, "-m", name, *map(str, arguments)]


class Process:
    """A child process; its output is kept and shown when it fails.

    `log` is a file for all of its output; without one, stdout and stderr are kept separately. The
    process ends with us, even when we are killed, if it calls `end_with_parent` or reads its
    input. Ctrl-C does not reach it: we pass that on, in the right order. With `session` false it
    stays in our session, so a scheduler that groups by sessions weighs it together with us; use
    this where time is measured. `popen` starts it in place of subprocess.Popen.
    """

    def __init__(
        self,
        command: Sequence[object],
        *,
        name: str = "",
        log: Path | None = None,
        environment: Mapping[str, str] | None = None,
        folder: Path | None = None,
        umask: int = -1,
        session: bool = True,
        popen: Callable[..., "subprocess.Popen[bytes]"] | None = None,
    ) -> None:
        self._command = [str(word) for word in command]
        self.name = name or Path(self._command[0]).name
        self._log_path = log
        self._environment = environment
        self._folder = folder
        self._umask = umask
        self._session = session
        self._popen = popen
        self._process: subprocess.Popen[bytes] | None = None
        self._output = self._errors = NOT_STARTED
        self._read_to = 0

    def start(self) -> None:
        """Start the process; a Ctrl-C meanwhile is delivered once the process can be stopped."""
        with _interrupts_later():
            self._output = self._errors = self._kept(self._log_path)
            if self._log_path is None:
                self._errors = self._kept(None)
                self._read_to = 0
            given = os.environ if self._environment is None else self._environment
            self._process = (self._popen or subprocess.Popen)(
                self._command,
                stdin=subprocess.PIPE,
                stdout=self._output,
                stderr=self._errors,
                start_new_session=self._session,
                process_group=None if self._session else 0,
                env={**given, parent.VARIABLE: "1"},
                cwd=self._folder,
                umask=self._umask,
            )

    @property
    def pid(self) -> int:
        """The process id, once the process is started."""
        return self._started.pid

    @property
    def is_running(self) -> bool:
        """Whether the process has started and not ended."""
        return self._process is not None and self._process.poll() is None

    @property
    def code(self) -> int | None:
        """The exit code, or minus the signal that ended the process; None while it runs."""
        return self._started.poll()

    def out(self) -> str:
        """What the process has written to stdout, or to its log."""
        return _text(self._output)

    def err(self) -> str:
        """What the process has written to stderr, or to its log."""
        return _text(self._errors)

    def log(self) -> str:
        """All output of the process, stdout first."""
        return self.out() if self._log_path is not None else self.out() + self.err()

    def last_words(self) -> str:
        """The last line of stderr, or failing that of stdout; without output, the exit code."""
        lines = [*self.out().splitlines(), *self.err().splitlines()]
        said = [line for line in lines if line.strip()]
        return said[-1].strip() if said else f"no output, exit code {self.code}"

    def tell(self, line: str) -> None:
        """Write a line to the process's stdin. Raises ProcessError when it no longer reads."""
        try:
            self._input.write(line.encode() + b"\n")
            self._input.flush()
        except BrokenPipeError:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._started.wait(LOOK_S)
            raise ProcessError(f"{self.name}: {self.last_words()}") from None

    def close_input(self) -> None:
        """Close the process's stdin, which also signals that nobody waits for it."""
        with contextlib.suppress(BrokenPipeError):
            self._input.close()

    def line(self, within_s: float = PATIENCE_S) -> str:
        """Wait for the next line of stdout and return it. Raises ProcessError."""
        found: list[str] = []

        def is_there() -> bool:
            rest = _bytes(self._output, self._read_to)
            end = rest.find(b"\n")
            if end >= 0:
                self._read_to += end + 1
                found.append(rest[:end].decode(errors="replace").strip())
            return bool(found)

        wait_until(is_there, within_s, self)
        return found[0]

    def wait(self, within_s: float = PATIENCE_S) -> int:
        """Wait until the process ends; returns its exit code. Raises ProcessError."""
        try:
            return self._started.wait(within_s)
        except subprocess.TimeoutExpired:
            raise ProcessError(f"{self.name}: did not finish within {within_s:g} s") from None

    def send_signal(self, number: int) -> None:
        """Send the process a signal; does nothing once it has ended."""
        self._started.send_signal(number)

    def stop(self, number: int = signal.SIGTERM, within_s: float = STOP_TIMEOUT_S) -> int | None:
        """Send signal `number`, and kill the process if it has not ended within `within_s`.

        Returns its exit code; None if it was not started.
        """
        if self._process is None:
            return None
        self._process.send_signal(number)
        try:
            self._process.wait(within_s)
        except subprocess.TimeoutExpired:
            self.kill()
        self.close_input()
        return self.code

    def kill(self) -> None:
        """Kill the process and its children at once; does nothing if it was not started."""
        if self._process is None:
            return
        if self.is_running:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.pid, signal.SIGKILL)
        self._process.wait()
        self.close_input()

    @property
    def _input(self) -> IO[bytes]:
        # Never None, as Popen gets stdin=PIPE.
        return cast("IO[bytes]", self._started.stdin)

    def _kept(self, path: Path | None) -> int:
        """A file descriptor to write and read, open for as long as this object exists."""
        if path is not None:
            # A restart appends to the output of the runs before.
            begin = os.O_TRUNC if self._process is None else 0
            file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | begin, 0o644)
        else:
            file, name = tempfile.mkstemp(prefix="sdrlinkd-said-")
            Path(name).unlink()
        weakref.finalize(self, os.close, file)
        return file

    @property
    def _started(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            raise RuntimeError(f"{self.name} was not started")
        return self._process

    def __enter__(self) -> Self:
        try:
            self.start()
        except BaseException:
            # After an interrupt during the start, nobody else would stop the process.
            self.stop()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def wait_until(
    condition: Callable[[], object],
    within_s: float = PATIENCE_S,
    *processes: Process,
    every_s: float = LOOK_S,
) -> None:
    """Wait until `condition()` holds.

    Raises ProcessError with the last output if one of `processes` ends first or time runs out.
    """
    deadline = time.monotonic() + within_s
    while True:
        # Read before the condition, so that what a process does just before it ends counts.
        ended = [each for each in processes if not each.is_running]
        if condition():
            return
        if ended:
            raise ProcessError(f"{ended[0].name} has ended: {ended[0].last_words()}")
        if time.monotonic() > deadline:
            said = "".join(f"; {each.name}: {each.last_words()}" for each in processes)
            raise ProcessError(f"timed out after {within_s:g} s{said}")
        time.sleep(every_s)


def _bytes(file: int, begin: int = 0) -> bytes:
    """The file's content from `begin` on, independent of the offset at which it is written."""
    return b"" if file == NOT_STARTED else os.pread(file, os.fstat(file).st_size - begin, begin)


def _text(file: int) -> str:
    return _bytes(file).decode(errors="replace")


@contextlib.contextmanager
def _interrupts_later() -> Iterator[None]:
    """Delay Ctrl-C until the end of this context, so that a new process is never orphaned."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    interrupts: list[int] = []
    handler = signal.signal(signal.SIGINT, lambda number, _: interrupts.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if interrupts:
            signal.raise_signal(signal.SIGINT)
