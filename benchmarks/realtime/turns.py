"""Runs a measurement several times, in turns with another checkout, and judges the median.

A hypervisor that gives this machine's time to others makes every message late. A run in which more
than MOST_STOLEN_PCT was stolen is repeated; if that does not help, its rows are not judged.
"""

import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Literal, NamedTuple

from benchmarks.absent import attempt
from benchmarks.processes import Stolen
from benchmarks.report import Row

RUNS, QUICK_RUNS = 3, 1
MOST_STOLEN_PCT = 10.0
REPEATS = 2
"""How often a run with too much stolen time is repeated at most."""
HERE, BEFORE = "here", "before"
"""Names of this checkout and of the other one."""


class Wanted(NamedTuple):
    """A row to be measured."""

    name: str
    unit: str
    target: float
    better: Literal["more", "less"] = "less"


class Run(NamedTuple):
    """What one run has measured."""

    values: Mapping[str, float]
    """Values by the name of the row."""
    trials: int
    note: str = ""
    notes: Mapping[str, str] = {}
    """More about single rows, by name."""


class Tried(NamedTuple):
    """A run, and how much of the machine's time was stolen during it, in % of all cores."""

    run: Run
    stolen_pct: float


Measure = Callable[[Path, int, bool], Run]
"""Measures the programs of a checkout once, from (checkout, seed, whether it should be quick)."""


def in_turns(
    what: str, measure: Measure, trees: Mapping[str, Path], seed: int, quick: bool
) -> dict[str, list[Tried]]:
    """Several runs of each checkout, alternately; a run that fails is reported and left out."""
    found: dict[str, list[Tried]] = {name: [] for name in trees}
    for i in range(QUICK_RUNS if quick else RUNS):
        for name, tree in trees.items():
            with attempt(f"{what}, run {i + 1} {name}"):
                found[name].append(with_least_stolen(partial(measure, tree, seed + i, quick)))
    return found


def with_least_stolen(measure: Callable[[], Run], stolen: Callable[[], Stolen] = Stolen) -> Tried:
    """Measure, and again while too much time was stolen; the run with the least stolen time."""
    tried: list[Tried] = []
    while len(tried) <= REPEATS and (not tried or tried[-1].stolen_pct > MOST_STOLEN_PCT):
        watch = stolen()
        run = measure()
        tried.append(Tried(run, watch.pct()))
    return min(tried, key=lambda each: each.stolen_pct)


def rows_of(wanted: Sequence[Wanted], found: Mapping[str, Sequence[Tried]]) -> Iterator[Row]:
    """The rows of all runs: the median here, and that of the other checkout as a peer.

    The stolen time of the worst run stands beside them.
    """
    here = found[HERE]
    if not here:
        return
    others = {name: runs for name, runs in found.items() if runs and name != HERE}
    stolen_pct = max(tried.stolen_pct for tried in here)
    for name, unit, target, better in wanted:
        notes = [_all(here, name), *_notes(here, name)]
        notes += [f"{other}: {_all(runs, name)}" for other, runs in others.items()]
        if stolen_pct > MOST_STOLEN_PCT:
            notes.insert(0, f"not judged: {stolen_pct:.0f} % of the machine's time was stolen")
        yield Row(
            name,
            _median(here, name),
            unit,
            target if stolen_pct <= MOST_STOLEN_PCT else None,
            better,
            sum(tried.run.trials for tried in here),
            {other: _median(runs, name) for other, runs in others.items()}
            | {"machine_stolen_pct": stolen_pct},
            note="; ".join(notes),
        )


def _median(runs: Sequence[Tried], name: str) -> float:
    return statistics.median(tried.run.values[name] for tried in runs)


def _notes(runs: Sequence[Tried], name: str) -> list[str]:
    """The notes of the run whose value is in the middle."""
    ordered = sorted((tried.run for tried in runs), key=lambda run: run.values[name])
    run = ordered[(len(ordered) - 1) // 2]
    return [note for note in (run.note, run.notes.get(name, "")) if note]


def _all(runs: Sequence[Tried], name: str) -> str:
    values = ", ".join(f"{tried.run.values[name]:.4g}" for tried in runs)
    stolen = ", ".join(f"{tried.stolen_pct:.1f}" for tried in runs)
    return f"runs {values}; stolen {stolen} %"
