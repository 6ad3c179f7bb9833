"""Forked children, some at a time, each with one job."""

import contextlib
import os
import pickle
import resource
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType
from typing import TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")
MOST_MEMORY = 2 << 30
"""Octets that a child may use more than its parent: an endless loop may fill a list."""
WAITS_S = 40
WAITS_SHARE = 0.002
"""A child that has less than this of the processor for WAITS_S, in s, only waits.

On a busy machine, one that computes has more.
"""


class ChildError(Exception):
    """A child raised this, which is our fault."""


def in_children(
    jobs: Iterable[Job], work: Callable[[Job], Result], n: int
) -> Iterator[tuple[Job, Result | None]]:
    """Each job and what `work` makes of it in a child, `n` at a time; None: the child died.

    What `work` raises is raised here.
    """
    running: dict[int, Job] = {}
    waiting = iter(jobs)
    with TemporaryDirectory() as folder:
        try:
            while True:
                while len(running) < n and (job := next(waiting, None)) is not None:
                    running[_fork(job, work, Path(folder))] = job
                if not running:
                    return
                pid, _ = os.wait()
                _end(pid)
                told = Path(folder) / str(pid)
                result = pickle.loads(told.read_bytes()) if told.exists() else None
                told.unlink(missing_ok=True)
                job = running.pop(pid)
                if isinstance(result, ChildError):
                    raise result
                yield job, result
        finally:
            for pid in running:
                _end(pid)
                os.waitpid(pid, 0)


def limit(cpu_s: float) -> None:
    """Let this process die after a CPU time, or when it has done nothing but wait for WAITS_S."""
    resource.setrlimit(resource.RLIMIT_CPU, (round(cpu_s) + 1, round(cpu_s) + 2))
    before_s = time.process_time()

    def look(_number: int, _frame: FrameType | None) -> None:
        nonlocal before_s
        now_s = time.process_time()
        if now_s - before_s < WAITS_SHARE * WAITS_S:
            os._exit(0)
        before_s = now_s
        signal.alarm(WAITS_S)

    signal.signal(signal.SIGALRM, look)
    signal.alarm(WAITS_S)


def _fork(job: Job, work: Callable[[Job], Result], folder: Path) -> int:
    sys.stdout.flush()
    pid = os.fork()
    if pid:
        return pid
    try:
        os.setpgid(0, 0)
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in range(3):
            os.dup2(nowhere, stream)
        in_use = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (in_use + MOST_MEMORY, in_use + MOST_MEMORY))
        _tell(folder, work(job))
    except Exception:
        _tell(folder, ChildError(traceback.format_exc()))
    finally:
        os._exit(0)


def _tell(folder: Path, result: object) -> None:
    part = folder / f"{os.getpid()}.part"
    part.write_bytes(pickle.dumps(result))
    part.rename(part.with_suffix(""))


def _end(pid: int) -> None:
    """End a child, and what it started."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)
