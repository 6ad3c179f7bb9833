"""A run as a figure and as tables, whatever its outcome."""

from pathlib import Path

import pytest
from rich.console import Console

from sdrlinkd.lab import (
    LabState,
    Scenario,
    find_scenario,
    live_table,
    load_scenario,
    pair_table,
    pictures,
)
from sdrlinkd.lab.testing import BINS, ClassOverTime
from tests.lab.reports import lost, pair, report, robot

NOBODY_MOVES = Scenario(robot=[])
HOPS = [1.0, 1.5, 2.0, 7.0, *[None] * (BINS - 4)]
CLASS = ClassOverTime(
    qos="urgent", pdr=[1.0, *[None] * (BINS - 1)], p50_ms=[5.0, *[None] * (BINS - 1)],
    p99_ms=[9.0, *[None] * (BINS - 1)],
)  # fmt: skip
STRANGE = "50 $_$ of [/b] robots [bold"
"""Characters that Matplotlib and Rich would interpret."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "given",
    [
        {"pairs": [], "robots": [robot(1)]},
        {"pairs": [lost(1, 2), lost(2, 1)], "title": ""},
        {"pairs": [pair(1, 2), lost(2, 1)], "out_of_reach": [(1, 3)]},
        {"robots": [robot(1, mcs_changes=[(0.5, 2, 4), (1.5, 2, 3), (1.0, 3, 0)]), robot(2)]},
        {"pairs": [pair(i, j) for i in range(9) for j in range(9) if i != j]},
        {"pairs": [pair(1, 2, hops=HOPS), pair(2, 1)], "classes": [CLASS]},
        {"pairs": [pair(1, 2, hops=[None] * BINS)], "classes": []},
        {
            "pairs": [pair(1, 2, hops=HOPS)],
            "classes": [CLASS],
            "robots": [robot(1, mcs_changes=[(0.5, 2, 4)]), robot(2)],
        },
    ],
)
def test_any_run_can_be_drawn_and_shown(tmp_path, given):
    check(report(**given), tmp_path / "lab.png", "sdrlinkctl lab small.toml")


def test_a_title_is_shown_as_it_is(tmp_path):
    check(report(title=STRANGE), tmp_path / "lab.png", f"sdrlinkctl lab {STRANGE}")


@pytest.mark.slow
def test_a_drive_is_drawn_with_its_distance(tmp_path):
    moved = load_scenario(find_scenario(Path("out-and-back")))
    check(report(), tmp_path / "lab.png", "", moved)
    still = (tmp_path / "lab.png").stat().st_size
    check(report(), tmp_path / "lab.png", "")
    assert (tmp_path / "lab.png").stat().st_size < still


def check(made, path, caption, scenario=NOBODY_MOVES):
    """Assert that it can be drawn and shown."""
    pictures.draw(made, scenario, path, caption)
    picture = path.read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 5000
    assert (made.title or made.scenario) in printed(pair_table(made))


def printed(what):
    console = Console(width=160)
    with console.capture() as capture:
        console.print(what)
    return capture.get()


def test_the_table_has_a_row_a_direction():
    shown = printed(pair_table(report(pairs=[pair(1, 2), lost(2, 1)])))
    rows = [line.split() for line in shown.splitlines() if line.split()[:1] in (["1"], ["2"])]
    assert rows[0] == ["1", "2", "30", "30", "1.0000", "20.00", "30.00", "█" * 10]
    assert rows[1] == ["2", "1", "30", "0", "0.0000", "–", "–", "·" * 5]


@pytest.mark.parametrize("title", ["Two robots", STRANGE])
def test_the_screen_is_there_before_the_first_robot_is(title):
    shown = printed(live_table(title, LabState(0.0, 3.5)))
    assert title in shown
    assert "0.0 of 3.5 s" in shown
