"""Processes of a benchmark: started, given their precedence, and measured from outside."""

import contextlib
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import NamedTuple, Self

from benchmarks.environments import interpreter, variables

REAL_TIME_PRIORITY = 10
NICE = -10
MOST_WORDS = 1 << 16
TICKS_HZ = os.sysconf("SC_CLK_TCK")
PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20


class PeerError(Exception):
    """A peer could not be measured; the message names the process and the reason."""


class Usage(NamedTuple):
    """What a process has taken so far."""

    cpu_s: float
    rss_mib: float


class Child:
    """A module of ours as a process of its own, in a peer's environment; ends with the block."""

    def __init__(self, name: str, module: str, *arguments: str, environment: str = "") -> None:
        self.name = name
        self._stack = stack = ExitStack()
        self._errors = stack.enter_context(TemporaryFile())  # noqa: SIM115
        process = subprocess.Popen(
            [interpreter(environment), "-m", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            env=variables(),
        )
        self._process = stack.enter_context(process)

    def precede(self, *, real_time: bool) -> None:
        """Before what else this machine does, so far as we are allowed to.

        In real time what stands for hardware; else what is another process of the companion.
        """
        pid = self._process.pid
        try:
            if real_time:
                priority = os.sched_param(REAL_TIME_PRIORITY)
                os.sched_setscheduler(pid, os.SCHED_FIFO, priority)
            else:
                os.setpriority(os.PRIO_PROCESS, pid, NICE)
        except PermissionError:
            pass

    def tell(self, line: str) -> None:
        """Write a line to it."""
        assert self._process.stdin
        try:
            print(line, file=self._process.stdin, flush=True)
        except BrokenPipeError:
            raise PeerError(f"{self.name}: {self._last_words()}") from None

    def line(self) -> str:
        """Wait for its next line."""
        assert self._process.stdout
        if not (line := self._process.stdout.readline().strip()):
            raise PeerError(f"{self.name}: {self._last_words()}")
        return line

    def finish(self) -> str:
        """Close its input, and wait for what it tells in the end."""
        assert self._process.stdin
        self._process.stdin.close()
        return self.line()

    def usage(self) -> Usage:
        """Of all its threads."""
        return _usage(self._process.pid)

    def usage_below(self) -> list[Usage]:
        """Of each process that it has started and that is there."""
        own, found = str(self._process.pid), []
        for folder in Path("/proc").glob("[0-9]*"):
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):
                if _fields(int(folder.name))[1] == own:
                    found.append(_usage(int(folder.name)))
        return found

    @property
    def has_ended(self) -> bool:
        """Of itself."""
        return self._process.poll() is not None

    def words(self) -> str:
        """What it has complained of so far."""
        said = os.pread(self._errors.fileno(), MOST_WORDS, 0)
        return said.decode(errors="replace").strip()

    def _last_words(self) -> str:
        status = self._process.wait()
        lines = self.words().splitlines()
        return lines[-1] if lines else f"ended without a word, status {status}"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._stack.close()


def _fields(pid: int) -> list[str]:
    """proc(5): the 3rd, its state, is the first here."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()


def _usage(pid: int) -> Usage:
    fields = _fields(pid)
    resident = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    # utime and stime are the 14th and 15th field.
    return Usage((int(fields[11]) + int(fields[12])) / TICKS_HZ, resident * PAGE_MIB)


class Stolen:
    """How much of the machine a hypervisor has given to others since; 0 % where none tells."""

    def __init__(self) -> None:
        self._since = _ticks()

    def pct(self) -> float:
        """Of all cores, so far."""
        stolen, total = (now - then for now, then in zip(_ticks(), self._since, strict=True))
        return 100 * stolen / max(1, total)


def _ticks() -> tuple[int, int]:
    """(stolen, all), proc_stat(5); guests' ticks, the last two, are in the users' already."""
    ticks = [int(each) for each in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    return ticks[7], sum(ticks)


@contextmanager
def busy_cores() -> Iterator[None]:
    """A program that never waits, on every core, at the usual priority."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in cores()]
    try:
        for process, core in zip(busy, cores(), strict=True):
            os.sched_setaffinity(process.pid, {core})
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def cores() -> list[int]:
    """Those that we may use."""
    return sorted(os.sched_getaffinity(0))
