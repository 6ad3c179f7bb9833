"""Processes of a benchmark: sets their priority, and measures them from outside."""

import contextlib
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from benchmarks.absent import PeerError
from benchmarks.environments import ROOT, interpreter, variables
from sdrlinkd.family import family, family_cpu_s
from sdrlinkd.process import Process

REAL_TIME_PRIORITY = 10
NICE = -10
MOST_S = 900.0
NO_HOOKS: Mapping[str, str] = {}
PAGE_MIB = os.sysconf("SC_PAGE_SIZE") / 2**20


class Usage(NamedTuple):
    """Resources that a process has used so far."""

    cpu_s: float
    rss_mib: float


def start_module(
    stack: ExitStack,
    name: str,
    module: str,
    *arguments: str,
    environment: str = "",
    tree: Path = ROOT,
    hooks: Mapping[str, str] = NO_HOOKS,
) -> Process:
    """Start a module of the checkout `tree` in a peer's environment; the stack kills it.

    `hooks` are environment variables for it; a PYTHONPATH comes before the checkout.
    """
    command = [interpreter(environment), "-m", module, *arguments]
    given = variables(tree)
    path = os.pathsep.join(filter(None, (hooks.get("PYTHONPATH"), given["PYTHONPATH"])))
    given = {**given, **hooks, "PYTHONPATH": path}
    process = Process(command, name=name, environment=given, folder=tree, session=False)
    stack.callback(process.kill)
    process.start()
    return process


def told_by(name: str, *command: object, within_s: float = MOST_S, tree: Path | None = None) -> str:
    """All output of a program, until it ends; with `tree`, it runs the code of that checkout.

    Raises PeerError, ProcessError and OSError.
    """
    environment = None if tree is None else variables(tree)
    with Process(
        command, name=name, environment=environment, folder=tree or ROOT, session=False
    ) as process:
        if process.wait(within_s):
            raise PeerError(f"{name}: {process.last_words()}")
        return process.out()


def precede(process: Process, *, real_time: bool) -> None:
    """Give a process priority over other programs on this machine, if permitted.

    Real-time priority is for processes that stand for hardware; the lower one is for other
    processes of the companion.
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
    """Resources that a process and all processes below it have used so far."""
    pages = 0
    for each in family(pid):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            pages += int(Path(f"/proc/{each}/statm").read_text().split()[1])
    return Usage(family_cpu_s(pid), pages * PAGE_MIB)


def family_memory_mb(pid: int) -> dict[str, float]:
    """Memory of a process and of all processes below it, in MB (10^6 bytes): `Pss` and `Rss`.

    A page that several processes share counts in parts for Pss, and in whole for each for Rss.
    """
    found = {"Pss": 0.0, "Rss": 0.0}
    for each in family(pid):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            for line in Path(f"/proc/{each}/smaps_rollup").read_text().splitlines():
                name, _, rest = line.partition(":")
                if name in found:
                    found[name] += 1.024e-3 * int(rest.split()[0])
    return found


class Stolen:
    """Share of the machine that a hypervisor has given to others; 0 % if unknown."""

    def __init__(self) -> None:
        self._since = _ticks()

    def pct(self) -> float:
        """Stolen time so far, in % of all cores."""
        stolen, total = (now - then for now, then in zip(_ticks(), self._since, strict=True))
        return 100 * stolen / max(1, total)


def _ticks() -> tuple[int, int]:
    """(stolen, all), proc_stat(5); the last two fields, guests' ticks, are part of user time."""
    ticks = [int(each) for each in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
    return ticks[7], sum(ticks)


@contextmanager
def busy_cores() -> Iterator[None]:
    """Run a program that never waits on every core, at the usual priority."""
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
