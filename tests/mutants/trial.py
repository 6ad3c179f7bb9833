"""The trials: which tests reach a line, and whether one of them fails with a change."""

import signal
import time
from bisect import bisect
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate, zip_longest
from pathlib import Path
from types import FrameType

import coverage
import pytest

from tests.mutants.children import in_children, limit

MOST_OF_ONE_S = 5.0
"""CPU time in s, of a test under coverage, from which on it is left out."""
MOST_S = 20.0
"""CPU time in s of the tests that are tried with one mutant."""
TOO_DEAR = f"takes more than {MOST_OF_ONE_S:.0f} s"
LEFT_OUT = ("realtime", "long", "soak", "fresh")
"""Markers of tests that take long, or need the machine for themselves."""


class TooDearError(BaseException):
    """A test takes too long; no test catches this."""


@dataclass(slots=True)
class Test:
    """A test, what it costs in s of CPU time, and the lines of the product that it reaches."""

    item: pytest.Item
    cpu_s: float = 0.0
    lines: set[tuple[str, int]] = field(default_factory=set)

    def reaches(self, path: Path, lines: range | None = None) -> bool:
        """Whether it reaches one of the lines of a file, or the file at all."""
        if lines is None:
            return any(file == str(path) for file, _ in self.lines)
        return any((str(path), line) in self.lines for line in lines)


@dataclass(slots=True)
class Mutant:
    """A changed program: what makes it, and the tests that can tell, the cheapest first."""

    change: object
    make: Callable[[], None]
    tests: list[Test]
    n_cut: int = 0
    """Tests that are not tried, for the time they take."""

    def __post_init__(self) -> None:
        total_s = list(accumulate(test.cpu_s for test in self.tests))
        n = max(1, bisect(total_s, MOST_S))
        self.n_cut, self.tests = len(self.tests[n:]), self.tests[:n]


class Trials:
    """Runs the items that pytest has collected, again and again, in children."""

    def __init__(self, items: Sequence[pytest.Item], sources: Sequence[Path], n: int) -> None:
        self._items = [
            item for item in items
            if not any(item.get_closest_marker(name) for name in LEFT_OUT)
        ]  # fmt: skip
        self._sources = [str(each) for each in sources]
        self._n = n
        self._failed: list[str] = []
        self.tests: list[Test] = []
        """Those that pass, the cheapest first."""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """pytest tells how a part of a test ended."""
        if report.failed:
            self._failed.append(report.nodeid)

    def learn(self) -> list[str]:
        """Learn what each test reaches; returns the names of those left out, and why."""
        by_file = defaultdict(list)
        for item in self._items:
            by_file[item.path].append(item)
        left_out = []
        for items, found in in_children(by_file.values(), self._learn_of, self._n):
            for item, (cpu_s, failed, lines) in zip_longest(
                items, found or (), fillvalue=(0.0, "ends", set())
            ):
                if failed:
                    left_out.append(f"{item.nodeid} ({failed})")
                else:
                    self.tests.append(Test(item, cpu_s, lines))
        self.tests.sort(key=lambda test: (test.cpu_s, test.item.nodeid))
        return left_out

    def judge(self, mutants: Iterable[Mutant]) -> Iterator[tuple[Mutant, str]]:
        """Each mutant and the test that fails, "time" if it had to be ended, "" if it survives."""
        for mutant, failed in in_children(mutants, self._try, self._n):
            yield mutant, "time" if failed is None else failed

    def _learn_of(self, items: list[pytest.Item]) -> list[tuple[float, str, set[tuple[str, int]]]]:
        """(CPU time, why it cannot be used, lines) of each item of a file."""
        limit(60 + MOST_OF_ONE_S * len(items))
        signal.signal(signal.SIGPROF, _too_dear)
        measured = coverage.Coverage(data_file=None, config_file=False, include=self._sources)
        # A file without a function that runs is no reason to complain.
        measured.set_option("run:disable_warnings", ["no-data-collected"])
        measured.start()
        found = []
        for item, following in zip(items, [*items[1:], None], strict=True):
            measured.switch_context(item.nodeid)
            since = time.process_time()
            signal.setitimer(signal.ITIMER_PROF, MOST_OF_ONE_S)
            try:
                failed = "fails" if self._run(item, following) else ""
            except TooDearError:
                failed = TOO_DEAR
            signal.setitimer(signal.ITIMER_PROF, 0)
            cpu_s = time.process_time() - since
            found.append((cpu_s, TOO_DEAR if cpu_s > MOST_OF_ONE_S else failed))
        measured.stop()
        data = measured.get_data()
        lines = defaultdict(set)
        for file in data.measured_files():
            for line, contexts in data.contexts_by_lineno(file).items():
                for context in contexts:
                    lines[context].add((file, line))
        return [(*each, lines[item.nodeid]) for item, each in zip(items, found, strict=True)]

    def _try(self, mutant: Mutant) -> str:
        planned_s = sum(test.cpu_s for test in mutant.tests)
        limit(3 + 2 * planned_s)
        mutant.make()
        items = [test.item for test in mutant.tests]
        for item, following in zip(items, [*items[1:], None], strict=True):
            if self._run(item, following):
                return item.nodeid
        return ""

    def _run(self, item: pytest.Item, following: pytest.Item | None) -> bool:
        """Run one item; returns whether it failed."""
        self._failed.clear()
        item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
        return bool(self._failed)


def _too_dear(_number: int, _frame: FrameType | None) -> None:
    raise TooDearError
