"""Changes one thing of the product at a time, and lists what no test noticed.

A package is a folder or a file: `bus`, `link/queue`, `wire/later.py`, `phy`.
"""

import argparse
import importlib
import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, settings

from tests.mutants.changes import Change
from tests.mutants.draw import PACKAGES, Package, measured, shares
from tests.mutants.ledger import Ledger, Row
from tests.mutants.live import Live
from tests.mutants.planted import PLANTED, Planted
from tests.mutants.trial import Mutant, Test, Trials
from tests.tiers import Suite

LEDGER = Path("docs/measured/mutants.json")
QUIETLY = ("-qq", "-s", "-p", "no:cacheprovider", "-p", "no:xdist", "--assert=plain")
EVERY = 20
"""After how many mutants a line tells how far it is."""


class Run:
    """A run: what pytest collected is tried with one mutant after the other."""

    def __init__(self, packages: list[Package], n: int, seed: int, ledger: Ledger) -> None:
        self.packages = packages
        self._shares = shares(packages, n)
        self._seed = seed
        self._ledger = ledger
        self._root = packages[0].root
        self._started = time.monotonic()
        self.rows = {each.name: Row(each.n_lines) for each in packages}
        self.tried: dict[Change, str] = {}
        self.planted: dict[str, str] = {}
        self.is_whole = False
        """Whether it has come to its end."""

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Take over from pytest, once the tests are collected."""
        if session.testsfailed:
            say("the tests cannot be collected")
            return True
        paths = [self._root / file for each in self.packages for file in each.files]
        # A child of this process shares its limits with others, and ends what it started itself.
        if suite := session.config.pluginmanager.get_plugin(Suite.NAME):
            suite.is_strict = False
        self._live = Live({path: importlib.import_module(self._module(path)) for path in paths})
        folders = measured(self.packages, self._root)
        self._trials = Trials(session.items, folders, os.cpu_count() or 1, self._root)
        session.config.pluginmanager.register(self._trials)
        left_out = self._trials.learn({str(path) for path in paths}, self._say)
        tests = self._trials.tests
        self._say(f"{len(tests)} tests, {sum(test.cpu_s for test in tests):.0f} s of CPU time")
        for name in left_out:
            say(f"  left out: {name}")
        self._leave_out_what_fails_unchanged()
        for n, (mutant, failed) in enumerate(self._trials.judge(self._mutants()), 1):
            self._judged(mutant, failed)
            if n % EVERY == 0:
                self._say(f"{n} of about {sum(self._shares)}")
        self.is_whole = True
        return True

    def _leave_out_what_fails_unchanged(self) -> None:
        """Tests that depend on others, or on an idle machine, prove nothing."""
        waiting = self.packages
        while waiting:
            unchanged = [Mutant(each, lambda: None, self._beside(each)) for each in waiting]
            waiting = []
            for mutant, failed in self._trials.judge(unchanged):
                if failed:
                    say(f"  left out: {failed} (fails in another order)")
                    self._trials.leave_out(failed)
                    waiting.append(mutant.change)

    def _beside(self, package: Package) -> list[Test]:
        """The tests of a package."""
        folders = [self._root / folder for folder in package.tests]
        return [
            test for test in self._trials.tests
            if any(test.item.path.is_relative_to(folder) for folder in folders)
        ]  # fmt: skip

    def _mutants(self) -> Iterator[Mutant]:
        for package, share in zip(self.packages, self._shares, strict=True):
            beside = self._beside(package)
            for planted in PLANTED:
                if planted.file in package.files:
                    path = self._root / planted.file
                    code = compile(planted.changed(path.read_text()), str(path), "exec")
                    make = self._live.maker(path, code)
                    reaching = [test for test in beside if test.reaches(path)]
                    yield Mutant(planted, make, reaching)
            for change, make in package.draw(share, self._seed, self._live):
                path = self._root / change.file
                reaching = [test for test in beside if test.reaches(path, change.lines)]
                yield Mutant(change, make, reaching)

    def _judged(self, mutant: Mutant, failed: str) -> None:
        match mutant.change:
            case Change() as change:
                self.tried[change] = failed
                row = next(
                    self.rows[each.name] for each in self.packages if change.file in each.files
                )
                reason, is_equivalent = self._ledger.known(change)
                row.drawn += 1
                row.killed += bool(failed)
                row.survived += not failed
                row.equivalent += is_equivalent and not failed
                if not failed:
                    cut = f" ({mutant.n_cut} tests cut)" if mutant.n_cut else ""
                    tests = f"{len(mutant.tests)} tests{cut}" if mutant.tests else "no test there"
                    say(f"survives: {change} [{tests}]{f': {reason}' if reason else ''}")
            case Planted(name=name, law=law, reason=reason):
                self.planted[name] = failed or (f"survives: {reason}" if reason else "")
                say(f"{name}, {law}: {self.planted[name] or 'survives'}")

    def _module(self, path: Path) -> str:
        name = ".".join(path.relative_to(self._root).with_suffix("").parts)
        return name.removesuffix(".__init__")

    def _say(self, text: str) -> None:
        say(f"{time.monotonic() - self._started:6.0f} s: {text}")


def say(text: str) -> None:
    """Print a line now."""
    print(text, flush=True)  # noqa: T201


def table(rows: dict[str, Row]) -> str:
    """The figures by package, and of all together."""
    head = ("package", "lines", "drawn", "killed", "survived", "equivalent", "rate")
    whole = Row(*(sum(getattr(row, name) for row in rows.values()) for name in Row.__slots__))
    cells = [head] + [
        (name, *(str(getattr(row, each)) for each in Row.__slots__), f"{row.rate:.1%}")
        for name, row in [*rows.items(), ("all", whole)]
    ]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if i else cell.ljust(width)
            for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        )
        for line in cells
    )


def main(arguments: list[str]) -> int:
    """Try mutants; 0: enough were noticed, 1: not enough, 2: aborted."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("package", nargs="*", default=PACKAGES, help=f"of {', '.join(PACKAGES)}")
    parser.add_argument("--n", type=int, default=400, help="mutants that are drawn")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help=f"write {LEDGER}")
    asked = parser.parse_args(arguments)
    try:
        packages = [Package.find(name, Path.cwd()) for name in asked.package]
    except ValueError as error:
        parser.error(str(error))
    ledger = Ledger.read(LEDGER)
    run = Run(packages, asked.n, asked.seed, ledger)
    # One failure is enough: it is neither made smaller nor kept. A busy machine is no failure.
    settings.register_profile(
        "mutants", phases=(Phase.explicit, Phase.generate), database=None,
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    settings.load_profile("mutants")
    # What runs is ended, too.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    say(f"seed {asked.seed}")
    folders = dict.fromkeys(folder for each in packages for folder in each.tests)
    pytest.main([*QUIETLY, *folders], plugins=[run])
    say(table(run.rows))
    if not run.is_whole:
        return 2
    if asked.keep:
        possible = [change for each in packages for change in each.changes]
        ledger.take(asked.seed, run.rows, possible, run.tried, run.planted)
        ledger.keep(LEDGER)
    is_enough = all(row.is_enough for row in run.rows.values()) and all(run.planted.values())
    return 0 if is_enough else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
