"""Processes of a benchmark: given their precedence, and measured from outside."""

import contextlib
import os
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from benchmarks.absent import PeerError
from benchmarks.environments import ROOT, interpreter, variables
from sdrlinkd.process import Process

REAL_TIME_PRIORITY = 10
NICE = -10
MOST_S = 900.0
TICKS_HZ = os.sysconf("SC_CLK_TCK")
PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20


class Usage(NamedTuple):
    """What a process has taken so far."""

    cpu_s: float
    rss_mib: float


def start_module(
    stack: ExitStack, name: str, module: str, *arguments: str, environment: str = ""
) -> Process:
    """A module of ours at work in a peer's environment; it is killed with the stack."""
    command = [interpreter(environment), "-m", module, *arguments]
    process = Process(command, name=name, environment=variables(), session=False)
    stack.callback(process.kill)
    process.start()
    return process


def told_by(name: str, *command: object, within_s: float = MOST_S) -> str:
    """All that a program prints until it is done. Raises PeerError, ProcessError and OSError."""
    with Process(command, name=name, folder=ROOT, session=False) as process:
        if process.wait(within_s):
            raise PeerError(f"{name}: {process.last_words()}")
        return process.out()


def precede(process: Process, *, real_time: bool) -> None:
    """Let it go before what else this machine does, so far as we are allowed to.

    In real time goes what stands for hardware; else what is another process of the companion.
    """
    try:
        if real_time:
            priority = os.sched_param(REAL_TIME_PRIORITY)
            os.sched_setscheduler(process.pid, os.SCHED_FIFO, priority)
        else:
            os.setpriority(os.PRIO_PROCESS, process.pid, NICE)
    except PermissionError:
        pass


def usage(pid: int) -> Usage:
    """What a process has taken so far, with all its threads."""
    fields = _fields(pid)
    resident = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    # utime and stime are the 14th and 15th field.
    return Usage((int(fields[11]) + int(fields[12])) / TICKS_HZ, resident * PAGE_MIB)


def usage_below(pid: int) -> list[Usage]:
    """What each process has taken that this one has started and that is there."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            if _fields(int(folder.name))[1] == str(pid):
                found.append(usage(int(folder.name)))
    return found


def _fields(pid: int) -> list[str]:
    """proc(5): the 3rd, its state, is the first here."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()


class Stolen:
    """How much of the machine a hypervisor has given to others since; 0 % where none tells."""

    def __init__(self) -> None:
        self._since = _ticks()

    def pct(self) -> float:
        """Stolen time so far, in % of all cores."""
        stolen, total = (now - then for now, then in zip(_ticks(), self._since, strict=True))
        return 100 * stolen / max(1, total)


def _ticks() -> tuple[int, int]:
    """(stolen, all), proc_stat(5); guests' ticks, the last two, are in the users' already."""
    ticks = [int(each) for each in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    return ticks[7], sum(ticks)


@contextmanager
def busy_cores() -> Iterator[None]:
    """A program that never waits, on every core, at the usual priority."""
    with ExitStack() as stack:
        for core in cores():
            process = Process([sys.executable, "-c", "while True: pass"], session=False)
            stack.callback(process.kill)
            process.start()
            os.sched_setaffinity(process.pid, {core})
        yield


def cores() -> list[int]:
    """The processor cores that this process may use."""
    return sorted(os.sched_getaffinity(0))
