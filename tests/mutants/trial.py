"""The trials: which tests reach a line, and whether one of them fails with a change."""

import gc
import pickle
import signal
import sys
import time
from bisect import bisect
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
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
STARTS = "start_daemon"
"""Fixture of tests that start programs, in which nothing is changed."""
EVERY = 20
"""After how many files of tests a line tells how far it is."""

Reached = tuple[float, str, set[tuple[str, int]]]
"""CPU time in s, why a test cannot be used ("" if it can), and the lines that it reaches."""


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


class Learnt:
    """What the tests of a file reach, kept for as long as neither product nor tests change."""

    def __init__(self, root: Path, measured: Sequence[str]) -> None:
        self._folder = root / "build" / "mutants"
        self._common = sha256(repr((sys.version, measured)).encode())
        for folder in ("sdrlinkd", "phy", "backends", "tests"):
            for path in sorted((root / folder).rglob("*.py")):
                if not path.name.startswith("test_") and path.parent.name != "mutants":
                    self._common.update(path.read_bytes())

    def knows(self, items: Sequence[pytest.Item]) -> bool:
        """Whether it was kept for the items of a file."""
        return self._path(items).exists()

    def of(self, items: Sequence[pytest.Item]) -> list[Reached]:
        """What was kept."""
        return pickle.loads(self._path(items).read_bytes())

    def keep(self, items: Sequence[pytest.Item], found: Sequence[Reached]) -> bool:
        """Keep it, unless something failed, which may have been the machine's fault."""
        if not found or any(failed not in ("", TOO_DEAR) for _, failed, _ in found):
            return False
        self._folder.mkdir(parents=True, exist_ok=True)
        self._path(items).write_bytes(pickle.dumps(found))
        return True

    def _path(self, items: Sequence[pytest.Item]) -> Path:
        about = self._common.copy()
        about.update(items[0].path.read_bytes())
        about.update(repr([item.nodeid for item in items]).encode())
        return self._folder / about.hexdigest()


class Trials:
    """Runs the items that pytest has collected, again and again, in children."""

    def __init__(
        self, items: Sequence[pytest.Item], folders: Sequence[Path], n: int, root: Path
    ) -> None:
        self._items = [
            item for item in items
            if not any(item.get_closest_marker(name) for name in LEFT_OUT)
            and STARTS not in getattr(item, "fixturenames", ())
        ]  # fmt: skip
        self._root = root
        self._measured = [f"{folder}/*" for folder in folders]
        self._n = n
        self._failed: list[str] = []
        self.tests: list[Test] = []
        """Those that pass, the cheapest first."""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """pytest tells how a part of a test ended."""
        if report.failed:
            self._failed.append(report.nodeid)

    def learn(self, files: set[str], say: Callable[[str], None]) -> list[str]:
        """Learn what each test reaches of `files`; returns the names of those left out, and why."""
        by_file = defaultdict(list)
        for item in self._items:
            by_file[item.path].append(item)
        learnt = Learnt(self._root, self._measured)
        unknown = [items for items in by_file.values() if not learnt.knows(items)]
        failing = {}
        for n, (items, found) in enumerate(in_children(unknown, self._learn_of, self._n), 1):
            if not learnt.keep(items, found or ()):
                failing[items[0].path] = found or ()
            if n % EVERY == 0:
                say(f"{n} of {len(unknown)} files of tests learnt")
        left_out = []
        for path, items in by_file.items():
            found = failing[path] if path in failing else learnt.of(items)
            for item, (cpu_s, failed, lines) in zip_longest(
                items, found, fillvalue=(0.0, "ends", set())
            ):
                if failed:
                    left_out.append(f"{item.nodeid} ({failed})")
                else:
                    self.tests.append(
                        Test(item, cpu_s, {each for each in lines if each[0] in files})
                    )
        self.tests.sort(key=lambda test: (test.cpu_s, test.item.nodeid))
        return left_out

    def leave_out(self, name: str) -> None:
        """Use a test no more. Raises ValueError if there is none of this name."""
        del self.tests[[test.item.nodeid for test in self.tests].index(name)]

    def judge(self, mutants: Iterable[Mutant]) -> Iterator[tuple[Mutant, str]]:
        """Each mutant and the test that fails, "time" if it had to be ended, "" if it survives."""
        # Children share what is there; none looks through it for garbage.
        gc.freeze()
        for mutant, failed in in_children(mutants, self._try, self._n):
            yield mutant, "time" if failed is None else failed

    def _learn_of(self, items: list[pytest.Item]) -> list[Reached]:
        """What is learnt of each item of a file."""
        limit(60 + MOST_OF_ONE_S * len(items))
        signal.signal(signal.SIGPROF, _too_dear)
        measured = coverage.Coverage(data_file=None, config_file=False, include=self._measured)
        # A file without a function that runs is no reason to complain.
        measured.set_option("run:disable_warnings", ["no-data-collected"])
        measured.start()
        found = []
        for item, following in zip_longest(items, items[1:]):
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
                place = (file, line)
                for context in contexts:
                    lines[context].add(place)
        return [(*each, lines[item.nodeid]) for item, each in zip(items, found, strict=True)]

    def _try(self, mutant: Mutant) -> str:
        planned_s = sum(test.cpu_s for test in mutant.tests)
        limit(3 + 2 * planned_s)
        mutant.make()
        items = [test.item for test in mutant.tests]
        for item, following in zip_longest(items, items[1:]):
            if self._run(item, following):
                return item.nodeid
        return ""

    def _run(self, item: pytest.Item, following: pytest.Item | None) -> bool:
        """Run one item; returns whether it failed."""
        self._failed.clear()
        try:
            item.ihook.pytest_runtest_protocol(item=item, nextitem=following)
        except Exception:
            # pytest itself stumbled.
            return True
        return bool(self._failed)


def _too_dear(_number: int, _frame: FrameType | None) -> None:
    raise TooDearError
