"""The tiers of the suite, enforced by what each test costs, and what is reported at the end.

tier      items                                     where            CPU s an item
quick     all that are not marked                   make quick       1
slow      marked, or start a daemon                 make test        10
realtime  radios or clocks in real time; alone      make test        10, or `most_s` of the mark
long      figures, whole systems, many trials       make test-long
"""

import contextlib
import fcntl
import json
import math
import os
import signal
import tempfile
import time
from collections import defaultdict
from collections.abc import Generator, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import pytest
from hypothesis import settings

from tests.copied import origin
from tests.cost import slowness, spent_s, started_by
from tests.laws import FACTOR, USUAL, law
from tests.machine import left_out
from tests.watchdog import Limits, Watchdog

FRESH = "SDRLINK_FRESH"
"""Set by `make fresh`."""
RUN = "SDRLINK_TEST_RUN"
"""Marks all processes that descend from one process of the suite."""
TIERS = ("quick", "slow", "realtime", "long")
MOST_S = {"quick": 1.0, "slow": 10.0, "realtime": 10.0}
SLOW_MACHINE = 3.0
"""What a test may cost more in CI, or where more than twice as many processes as cores compute.

What neighbours of a virtual machine, or an old core, cost is measured: see `slowness`."""
MORE_TRIALS = max(1.0, FACTOR / USUAL)
"""How many times the trials of `make test` this run makes; it takes as much longer."""
LIMITS = {"long": Limits(cpu_s=3600, idle_s=900, wall_s=7200)}
USUAL_LIMITS = Limits(cpu_s=120 * MORE_TRIALS, idle_s=90, wall_s=600 * MORE_TRIALS)
TABLE = Path(__file__).parents[1] / "CONTRIBUTING.md"
DEAREST = 10
SLOW = 1.5
LOOK_S = 20.0
"""How often the slowness of the core is measured."""


@dataclass
class Cost:
    """Processor time in s of one item, and of the fixtures that it set up for others, too."""

    tier: str
    own_s: float = 0.0
    shared_s: float = 0.0
    slowness: float = 1.0
    """Of the core, at that time."""
    most_s: float = 0.0
    """What it may cost; 0: what its tier allows."""

    @property
    def all_s(self) -> float:
        """Both together."""
        return self.own_s + self.shared_s


class Suite:
    """What one process of a test run knows: its items' costs, their limits, what they leave."""

    NAME = "sdrlink-suite"

    def __init__(self, config: pytest.Config) -> None:
        worker = getattr(config, "workerinput", None)
        self._name = f"{worker['testrunuid']}-{worker['workerid']}" if worker else str(os.getpid())
        self._alone = _lock(worker["testrunuid"]) if worker else None
        os.environ[RUN] = self._name
        self._begin_s, self._shared_s = 0.0, 0.0
        self._begin = time.monotonic()
        self._slowness, self._slowest, self._looked_at = 1.0, 1.0, -math.inf
        self._costs: dict[str, Cost] = {}
        self.is_strict = True
        """Whether items that cost too much, hang, or leave processes, fail."""
        self._watchdog = Watchdog()
        self._watchdog.start()

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Watch the item; one in real time waits until no other item runs."""
        which = tier(item)
        limits = LIMITS.get(which, USUAL_LIMITS)
        with self._turn(alone=_is_alone(item)):
            self._begin_s, self._shared_s = spent_s(), 0.0
            if self.is_strict and FACTOR <= 1:
                self._watchdog.watch(item.nodeid, limits)
            try:
                return (yield)
            finally:
                self._watchdog.rest()

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(
        self, fixturedef: pytest.FixtureDef[object]
    ) -> Generator[None, object, object]:
        """What several items share is not charged to the one that comes first."""
        if fixturedef.scope == "function":
            return (yield)
        begin, before = spent_s(), self._shared_s
        try:
            return (yield)
        finally:
            self._shared_s = before + spent_s() - begin

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_teardown(
        self, item: pytest.Item, nextitem: pytest.Item | None
    ) -> Generator[None, object, object]:
        """Fail an item that costs more than its tier allows, or that leaves processes behind."""
        result = yield
        if not self.is_strict:
            return result
        if nextitem is None or nextitem.path != item.path:
            self._end_what_is_left()
        own_s = spent_s() - self._begin_s - self._shared_s
        marker = item.get_closest_marker(which := tier(item))
        most_s = marker.kwargs.get("most_s", 0.0) if marker else 0.0
        cost = Cost(which, own_s, self._shared_s, self._slow(), most_s)
        item.user_properties.append(("cost", asdict(cost)))
        # Who else computes on a virtual machine's core changes from second to second.
        if too_dear(cost, 1.0) and (complaint := too_dear(cost, allowance() * self._slowest)):
            pytest.fail(complaint, pytrace=False)
        return result

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Collect the costs, in the process that reports."""
        for name, cost in report.user_properties if report.when == "teardown" else ():
            if name == "cost":
                self._costs[report.nodeid] = Cost(**cost)

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Report the dearest items, the sum by tier, and each item that was skipped."""
        if not self._costs:
            return
        write = terminalreporter.write_line
        dearest = sorted(self._costs.items(), key=lambda each: -each[1].all_s)[:DEAREST]
        write(f"the {len(dearest)} most expensive, in CPU s:")
        for name, cost in dearest:
            shared = f", of it {cost.shared_s:.1f} shared" if cost.shared_s > 0.05 else ""
            write(f"  {cost.all_s:6.1f} {cost.tier:8} {name}{shared}")
        sums = by_tier(self._costs.values())
        write("; ".join(f"{name}: {n} items, {cpu_s:.0f} CPU s" for name, n, cpu_s in sums))
        # All workers descend from this process.
        spent, wall = spent_s(), time.monotonic() - self._begin
        write(f"in all {spent:.0f} CPU s, collection included, in {wall:.0f} s by the clock")
        usual = sum(cost.all_s / cost.slowness for cost in self._costs.values())
        slow = sum(cost.all_s for cost in self._costs.values()) / max(usual, 1e-9)
        if slow > SLOW:
            write(f"this machine computed {slow:.1f} times as slowly as a core of 3 GHz: there, "
                  f"{spent / slow:.0f} CPU s")  # fmt: skip
        if command := os.environ.get("SDRLINK_KEEP_TIERS"):
            TABLE.write_text(kept(TABLE.read_text(), command, sums, spent, wall, slow))

    @contextlib.contextmanager
    def _turn(self, *, alone: bool) -> Iterator[None]:
        """All run beside each other, but those in real time alone."""
        if self._alone is None:
            yield
            return
        fcntl.flock(self._alone, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        try:
            yield
        finally:
            fcntl.flock(self._alone, fcntl.LOCK_UN)

    def _slow(self) -> float:
        if (now := time.monotonic()) > self._looked_at + LOOK_S:
            self._slowness, self._looked_at = slowness(), now
            self._slowest = max(self._slowest, self._slowness)
        return self._slowness

    def share(self, seconds: float) -> None:
        """Do not charge this processor time to the item that runs: others have use of it, too."""
        self._shared_s += seconds

    def _end_what_is_left(self) -> None:
        left = [*started_by(f"{RUN}={self._name}"), *origin.left()]
        for pid, *_ in left:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        if left:
            told = "; ".join(f"{test}: {command}" for _, test, command in left)
            pytest.fail(f"processes are left behind by {told}", pytrace=False)


def tier(item: pytest.Item) -> str:
    """The name of the tier to which an item belongs."""
    return next((name for name in reversed(TIERS) if item.get_closest_marker(name)), TIERS[0])


def _is_alone(item: pytest.Item) -> bool:
    return item.get_closest_marker("realtime") is not None


def allowance() -> float:
    """How many times the limits of the tiers an item may cost in this run, on a usual core."""
    is_busy = "CI" in os.environ or os.getloadavg()[0] > 2 * (os.cpu_count() or 1)
    return MORE_TRIALS * (SLOW_MACHINE if is_busy else 1.0)


def too_dear(cost: Cost, allowed: float) -> str:
    """Why an item belongs elsewhere; "" if it does not."""
    most = allowed * (cost.most_s or MOST_S.get(cost.tier, float("inf")))
    dearer = "slow" if cost.tier == "quick" and cost.own_s <= allowed * MOST_S["slow"] else "long"
    if cost.own_s > most:
        return (
            f"it costs {cost.own_s:.1f} s of processor time; tier {cost.tier} allows {most:g} s: "
            f"make it cheaper, or mark it `{dearer}`"
        )
    return ""


def by_tier(costs: Iterator[Cost]) -> list[tuple[str, int, float]]:
    """Each tier that has items: its name, their number, their processor time in s."""
    sums: dict[str, list[float]] = defaultdict(list)
    for cost in costs:
        sums[cost.tier].append(cost.all_s)
    return [(name, len(sums[name]), sum(sums[name])) for name in TIERS if name in sums]


def kept(
    text: str, command: str, sums: list[tuple[str, int, float]], spent_s: float, wall_s: float,
    slow: float,
) -> str:  # fmt: skip
    """The text with the row of `command` in the table of tiers made anew."""
    items = {name: f"{n} ({cpu_s:.0f} CPU s)" for name, n, cpu_s in sums}
    cells = [items.get(name, "–") for name in TIERS]
    row = f"| `{command}` | {' | '.join(cells)} | {spent_s:.0f} | {wall_s:.0f} | {slow:.1f} |"
    begin = f"| `{command}` |"
    lines = text.splitlines()
    place = max(n for n, line in enumerate(lines) if line.startswith(begin))
    return "\n".join([*lines[:place], row, *lines[place + 1 :]]) + "\n"


def _lock(run: str) -> int:
    """A file that all processes of a run lock while an item runs."""
    path = Path(tempfile.gettempdir()) / f"sdrlink-tests-{os.getuid()}-{run}"
    return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)


def pytest_configure(config: pytest.Config) -> None:
    """A shell's background job ignores SIGINT, and so would all processes that tests start."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    # Tests that do not state how many examples they need.
    settings.register_profile("law", law())
    settings.load_profile("law")
    config.pluginmanager.register(Suite(config), Suite.NAME)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark those as slow that start a daemon, unless they are marked as quick.

    Those for `make fresh` run only there. Those in real time come last; before them come files
    without slow tests, so that all workers have something to do until then.
    """
    later = [] if os.environ.get(FRESH) else [i for i in items if i.get_closest_marker("fresh")]
    if later:
        config.hook.pytest_deselected(items=later)
        items[:] = [item for item in items if item not in later]
    for item in items:
        starts = "start_daemon" in getattr(item, "fixturenames", ())
        if starts and not item.get_closest_marker("quick"):
            item.add_marker(pytest.mark.slow)
    slow = {item.path for item in items if tier(item) == "slow"}
    items.sort(key=lambda item: (_is_alone(item), item.path not in slow))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Report each test that was skipped, and in one line what all of them need."""
    skipped = terminalreporter.stats.get("skipped", [])
    rows = sorted(
        tuple(row)
        for report in terminalreporter.stats.get("passed", [])
        for name, row in getattr(report, "user_properties", ())
        if name == "scorecard"
    )
    if path := os.environ.get("SDRLINK_SCORECARD"):
        Path(path).write_text(json.dumps(rows))
    for report in skipped:
        terminalreporter.write_line(f"skipped: {report.nodeid}")
    if line := left_out([report.longrepr[2].removeprefix("Skipped: ") for report in skipped]):
        terminalreporter.write_line(line)
