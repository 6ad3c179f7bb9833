"""Rows of a benchmark, as a table for people and as JSON for programs."""

import argparse
import json
import os
import platform
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Literal

from sdrlinkd.tables import FittedTable, figure, screen_console, words


@dataclass
class Row:
    """One measured figure beside its target and its peers."""

    name: str
    value: float
    unit: str
    target: float | None
    """None: it is only told."""
    better: Literal["more", "less"]
    trials: int
    peers: dict[str, float] = field(default_factory=dict)
    paper: float | None = None
    note: str = ""
    like_for_like: float | None = None
    """The value scaled by how a peer runs here, against where the target was set."""

    @property
    def ok(self) -> bool:
        """Whether the target is met: where machines are slow, by what a peer reaches on them."""
        if self.target is None:
            return True
        values = [value for value in (self.value, self.like_for_like) if value is not None]
        if self.better == "more":
            return max(values) >= self.target
        return min(values) <= self.target


def main(
    benchmark: str,
    measure: Callable[..., list[Row]],
    own: argparse.ArgumentParser | None = None,
) -> int:
    """Parse the options all benchmarks share, measure, print; 1 when a row misses its target.

    `measure` gets seed and quick, and by name the options of `own`.
    """
    parser = argparse.ArgumentParser(
        prog=f"python -m benchmarks.{benchmark}", parents=[own] if own else []
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--quick", action="store_true", help="fewer trials, the same rows")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    ours = {key: getattr(options, key) for key in vars(own.parse_args([]))} if own else {}
    rows = measure(options.seed, options.quick, **ours)
    machine = f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    if options.json:
        report = {
            "benchmark": benchmark,
            "machine": machine,
            "seed": options.seed,
            "rows": [{**asdict(row), "ok": row.ok} for row in rows],
        }
        sys.stdout.write(json.dumps(report, indent=2) + "\n")
    else:
        screen_console().print(table_of(benchmark, rows))
    return 0 if all(row.ok for row in rows) else 1


def table_of(benchmark: str, rows: list[Row]) -> FittedTable:
    """What a person reads."""
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
        sign = "≥" if row.better == "more" else "≤"
        table.add(
            row.name,
            here,
            "" if row.target is None else f"{sign} {row.target:,.4g}",
            ", ".join(f"{name} {value:,.4g}" for name, value in row.peers.items()),
            str(row.trials),
            style="" if row.ok else "bold red",
        )
    return table
