"""Runs in turns: which are repeated, which rows are judged, and what the median is."""

from pathlib import Path

import pytest

from benchmarks import absent
from benchmarks.absent import PeerError
from benchmarks.realtime import rows
from benchmarks.realtime.turns import (
    BEFORE,
    HERE,
    REPEATS,
    Run,
    Tried,
    Wanted,
    in_turns,
    rows_of,
    with_least_stolen,
)
from tests.benchmark_rows import ROWS

LATE = Wanted("late", "ms", 5.0)


@pytest.fixture(autouse=True)
def nothing_told():
    absent.forget()


class Watch:
    """A stopwatch of stolen time that shows one of several values, in order."""

    def __init__(self, *pct):
        self._pct = list(pct)

    def __call__(self):
        return self

    def pct(self):
        return self._pct.pop(0)


def tried(value, stolen_pct=0.0, note=""):
    return Tried(Run({"late": value}, 10, note), stolen_pct)


@pytest.mark.parametrize(("stolen", "kept", "runs"), [
    ((0.0,), 0, 1), ((10.0,), 0, 1), ((11.0, 3.0), 1, 2), ((30.0, 12.0, 9.0), 2, 3),
    ((30.0, 12.0, 40.0), 1, 3), ((12.0, 30.0, 40.0), 0, 3),
])  # fmt: skip
def test_a_run_is_repeated_while_time_is_stolen(stolen, kept, runs):
    done = []

    def measure():
        done.append(len(done))
        return Run({"late": float(done[-1])}, 1)

    found = with_least_stolen(measure, Watch(*stolen))
    assert (found.run.values["late"], found.stolen_pct) == (kept, stolen[kept])
    assert len(done) == runs <= 1 + REPEATS


def test_a_row_is_the_median_and_is_judged():
    (row,) = rows_of([LATE], {HERE: [tried(9.0, 1, "c"), tried(1.0, 2, "a"), tried(4.0, 3, "b")]})
    assert (row.value, row.target, row.trials, row.ok) == (4.0, 5.0, 30, True)
    assert row.note == "runs 9, 1, 4; stolen 1.0, 2.0, 3.0 %; b"
    assert row.peers == {"machine_stolen_pct": 3.0}
    (row,) = rows_of([LATE], {HERE: [tried(9.0), tried(1.0), tried(6.0)]})
    assert not row.ok


def test_a_row_with_stolen_time_is_not_judged():
    (row,) = rows_of([LATE], {HERE: [tried(9.0), tried(99.0, 20.6), tried(9.0)]})
    assert (row.value, row.target, row.ok) == (9.0, None, True)
    assert row.note.startswith("not judged: 21 % of the machine's time was stolen; runs 9, 99, 9")


def test_the_other_checkout_is_a_peer_and_is_not_judged():
    (row,) = rows_of([LATE], {HERE: [tried(4.0)], BEFORE: [tried(8.0, 50.0), tried(6.0)]})
    assert (row.value, row.target) == (4.0, 5.0)
    assert row.peers == {BEFORE: 7.0, "machine_stolen_pct": 0.0}
    assert row.note == "runs 4; stolen 0.0 %; before: runs 8, 6; stolen 50.0, 0.0 %"


def test_checkouts_take_turns_with_the_same_seeds():
    asked = []

    def measure(tree, seed, quick):
        asked.append((tree.name, seed, quick))
        return Run({"late": 1.0}, 1)

    trees = {HERE: Path("new"), BEFORE: Path("old")}
    in_turns("x", measure, trees, 5, quick=False)
    firsts = list(dict.fromkeys(asked))
    assert firsts == [(name, seed, False) for seed in (5, 6, 7) for name in ("new", "old")]
    asked.clear()
    in_turns("x", measure, trees, 5, quick=True)
    assert list(dict.fromkeys(asked)) == [("new", 5, True), ("old", 5, True)]


def test_a_run_that_fails_costs_only_itself(capsys):
    def measure(tree, seed, quick):
        if tree.name == "old" or seed == 2:
            raise PeerError("the daemon sent nothing")
        return Run({"late": float(seed)}, 1)

    found = in_turns("start", measure, {HERE: Path("new"), BEFORE: Path("old")}, 1, quick=False)
    (row,) = rows_of([LATE], found)
    assert (row.value, row.trials, list(row.peers)) == (2.0, 2, ["machine_stolen_pct"])
    told = capsys.readouterr().err.splitlines()
    assert told[0] == "not measured: start, run 1 before: the daemon sent nothing"
    assert told[1] == "not measured: start, run 2 here: the daemon sent nothing"
    assert not list(rows_of([LATE], {HERE: []}))


def test_only_the_wanted_rows_are_measured(monkeypatch):
    def measure(tree, seed, quick):
        return Run({"a": 1.0, "b": 2.0}, 1)

    def never(tree, seed, quick):
        raise AssertionError

    monkeypatch.setattr(rows, "EXPERIMENTS", (
        rows.Experiment("one", measure, (Wanted("a", "s", 1.0), Wanted("b", "s", 1.0))),
        rows.Experiment("other", never, (Wanted("c", "s", 1.0),)),
    ))  # fmt: skip
    found = rows.rows(["b"], {HERE: Path()}, 1, quick=True)
    assert [(row.name, row.value, row.ok) for row in found] == [("b", 2.0, False)]


def test_each_name_stands_for_one_row():
    assert sorted(rows.NAMES) == sorted(ROWS["realtime"])
