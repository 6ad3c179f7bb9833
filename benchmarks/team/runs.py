"""Runs simulations at once, each in a process of its own, in as many as there are cores.

Nothing that a simulation finds depends on the others, so the rows are the same however many run.
"""

import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable, Hashable, Iterable, Mapping
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, NamedTuple, Self, TypeVar

from benchmarks.absent import PeerError, attempt

LOOK_S = 0.5
"""How often to look whether the keyboard has interrupted us, in s."""
T = TypeVar("T")
Key = TypeVar("Key", bound=Hashable)


class Run(Generic[T]):
    """A simulation that will have a result."""

    def __init__(self, runs: "Runs", name: str, cost: float, what: Callable[[], T]) -> None:
        self.name = name
        self.cost = cost
        self.what = what
        self.found: T | None = None
        self.error: Exception | None = None
        self.is_over = False
        self._runs = runs

    def result(self) -> T:
        """What it found, as soon as it is over. Raises what it has raised."""
        self._runs.wait_for(self)
        if self.error is not None:
            raise self.error
        return self.found  # type: ignore[return-value]  # None may be what it found


class _UnderWay(NamedTuple):
    run: Run  # type: ignore[type-arg]  # any
    process: multiprocessing.Process


class Runs:
    """Simulations, of which `processes` go on at once, those of the highest cost first.

    They begin when the first result is asked for. After the block, none goes on.
    """

    def __init__(self, processes: int = 0) -> None:
        self._processes = processes or len(os.sched_getaffinity(0))
        self._waiting: list[Run] = []  # type: ignore[type-arg]
        self._under_way: dict[Connection, _UnderWay] = {}
        self._n_over = 0
        self._is_interrupted = False
        self._before: Any = None
        """What an interrupt does outside of the block."""

    def __enter__(self) -> Self:
        # An exception raised by a signal may be lost in a callback of Python's. In the processes
        # of the simulations, which inherit this, an interrupt does nothing.
        self._before = signal.signal(signal.SIGINT, self._interrupt)
        return self

    def __exit__(self, *_: object) -> None:
        signal.signal(signal.SIGINT, self._before)
        self._waiting.clear()
        for ours, each in self._under_way.items():
            each.process.kill()
            each.process.join()
            ours.close()
        self._under_way.clear()

    def add(self, name: str, cost: float, what: Callable[[], T]) -> Run[T]:
        """Add a simulation, which takes about `cost` in any unit."""
        run = Run(self, name, cost, what)
        self._waiting.append(run)
        self._waiting.sort(key=lambda each: each.cost)
        return run

    def wait_for(self, run: Run[T]) -> None:
        """Let simulations go on until this one is over."""
        while not run.is_over:
            while self._waiting and len(self._under_way) < self._processes:
                self._start(self._waiting.pop())
            for ours in wait([*self._under_way], LOOK_S):
                self._finish(ours)  # type: ignore[arg-type]  # these are connections
            if self._is_interrupted:
                raise KeyboardInterrupt

    def _interrupt(self, *_: object) -> None:
        self._is_interrupted = True

    def _start(self, run: Run[T]) -> None:
        ours, theirs = multiprocessing.Pipe(duplex=False)
        process = multiprocessing.Process(target=_work, args=(run.what, theirs), daemon=True)
        process.start()
        theirs.close()
        self._under_way[ours] = _UnderWay(run, process)

    def _finish(self, ours: Connection) -> None:
        run, process = self._under_way.pop(ours)
        try:
            run.found, run.error, used_s = ours.recv()
        except EOFError:
            process.join()
            run.error, used_s = PeerError(f"its process ended with {process.exitcode}"), 0.0
        ours.close()
        process.join()
        run.is_over = True
        self._n_over += 1
        n = self._n_over + len(self._under_way) + len(self._waiting)
        sys.stderr.write(f"{self._n_over} of {n}: {run.name}, {used_s:.1f} s of processor time\n")


def results(runs: Mapping[Key, Run[T]]) -> dict[Key, T]:
    """The results of those that do not fail; the others are reported."""
    found = dict[Key, T]()
    for key, run in runs.items():
        with attempt(run.name):
            found[key] = run.result()
    return found


def all_of(runs: Iterable[Run[T]]) -> list[T]:
    """The results of all of them. Raises what one of them has raised."""
    return [run.result() for run in runs]


def _work(what: Callable[[], T], theirs: Connection) -> None:
    try:
        told: tuple[T | None, Exception | None] = what(), None
    except Exception as error:  # It is raised where the result is used.
        told = None, error
    used_s = time.process_time()
    try:
        theirs.send((*told, used_s))
    except (TypeError, AttributeError, ValueError) as error:
        theirs.send((None, PeerError(repr(error)), used_s))
