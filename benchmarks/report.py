"""Rows of a benchmark, as a table for people and as JSON for programs."""

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypeVar

from benchmarks.absent import attempt, told
from benchmarks.kept import circumstances, keep
from benchmarks.processes import Stolen
from sdrlinkd.tables import FittedTable, figure, screen_console, words

Found = TypeVar("Found")
SIGNS = {"more": "≥", "less": "≤"}


@dataclass
class Drawing:
    """The data of a picture of this benchmark: numbers and names only, as JSON holds them."""

    name: str
    shows: dict[str, Any]


@dataclass
class Row:
    """One measured figure with its target and its peers."""

    name: str
    value: float
    unit: str
    target: float | None
    """The target; None: the row is only reported."""
    better: Literal["more", "less"]
    trials: int
    peers: dict[str, float] = field(default_factory=dict)
    paper: float | None = None
    note: str = ""
    like_for_like: float | None = None
    """The value scaled by a peer's speed here against the targets' machine; only reported."""
    exact: bool = False
    """Whether the same seed gives the same value on every machine: lock-step, or calculation."""
    includes: str = ""
    """What the measured path consists of, where rows of one table differ in it."""

    @property
    def ok(self) -> bool:
        """Whether the value as measured here meets its target."""
        if self.target is None:
            return True
        return self.value >= self.target if self.better == "more" else self.value <= self.target


def exactly(found: Iterable[Found]) -> Iterator[Found]:
    """Mark the rows as exact; drawings pass as they are."""
    for each in found:
        if isinstance(each, Row):
            each.exact = True
        yield each


def main(
    benchmark: str,
    measure: Callable[..., Iterable[Row | Drawing]],
    own: argparse.ArgumentParser | None = None,
) -> int:
    """Parse the common options of benchmarks, measure, print; returns the exit code.

    0: all targets are met; 1: a row misses its target; 2: the benchmark was aborted, or nothing
    could be measured. Everything measured so far is printed in any case. `measure` gets seed and
    quick, and by name the options of `own`.
    """
    parser = argparse.ArgumentParser(
        prog=f"python -m benchmarks.{benchmark}", parents=[own] if own else []
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--quick", action="store_true", help="fewer trials, the same rows")
    parser.add_argument(
        "--keep", action="store_true",
        help=f"write docs/measured/{benchmark}.json, of which `make figures` makes the page",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    ours = {key: getattr(options, key) for key in vars(own.parse_args([]))} if own else {}
    rows: list[Row] = []
    drawings: dict[str, Any] = {}
    stolen, is_aborted = Stolen(), False
    try:
        with attempt("the rest") as all_of_it:
            for found in measure(options.seed, options.quick, **ours):
                # One by one: what is measured is kept, whatever comes next.
                if isinstance(found, Drawing):
                    drawings[found.name] = found.shows
                else:
                    rows.append(found)
    except KeyboardInterrupt:
        is_aborted = True
        sys.stderr.write("aborted: what follows is not complete\n")
    finally:
        report = _report(benchmark, rows, options, stolen.pct())
        if options.json:
            sys.stdout.write(json.dumps(report, indent=2) + "\n")
        else:
            screen_console().print(table_of(benchmark, rows))
        if options.keep and rows and not is_aborted:
            path = keep(benchmark, {**report, "drawings": drawings})
            sys.stderr.write(f"kept in {path}\n")
    if is_aborted or all_of_it.failed or not rows:
        return 2
    return 0 if all(row.ok for row in rows) else 1


def _report(
    benchmark: str, rows: list[Row], options: argparse.Namespace, stolen_pct: float
) -> dict[str, Any]:
    quick = " --quick" if options.quick else ""
    return {
        "benchmark": benchmark,
        "command": f"python -m benchmarks.{benchmark}{quick}",
        **circumstances(stolen_pct),
        "seed": options.seed,
        "rows": [{**asdict(row), "ok": row.ok} for row in rows],
        "not_measured": told(),
    }


def table_of(benchmark: str, rows: list[Row]) -> FittedTable:
    """The rows as a table for people, with missed targets marked."""
    table = FittedTable(
        f"benchmarks.{benchmark}",
        (
            words("row", least=40), figure("value"), figure("target", 1),
            words("peers in the same run", 3), figure("trials", 2),
        ),
    )  # fmt: skip
    for row in rows:
        here = f"{row.value:,.4g} {row.unit}"
        if row.like_for_like is not None:
            here += f" ({row.like_for_like:,.4g})"
        target = "" if row.target is None else f"{SIGNS[row.better]} {row.target:,.4g}"
        table.add(
            f"{row.name}: {row.includes}" if row.includes else row.name,
            here,
            target if row.ok else f"{target} missed",
            ", ".join(f"{name} {value:,.4g}" for name, value in row.peers.items()),
            str(row.trials),
            style="" if row.ok else "bold red",
        )
    return table
