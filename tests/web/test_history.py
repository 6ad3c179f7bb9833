"""The last ten minutes of a station, once a second."""

import pytest

from sdrlinkd.reports import ClockReport
from sdrlinkd.web.testing import (
    KEPT_S,
    MOST_LINES,
    PICTURES,
    History,
    empty_chart,
    empty_waterfall,
    newest,
    series,
    waterfall,
)
from tests.reported import neighbor, snapshot, topic


def lines(history, picture):
    return {name: list(values) for name, values in history.lines[picture].items()}


def test_it_keeps_what_a_station_reported():
    history = History()
    clock = ClockReport(state="synced", bound_us=12.0)
    for second, dropped in enumerate((0, 4, 4)):
        each = neighbor(2, snr_db=20.0 + second, per_lately=0.1, snr_there_db=9.0, clock=clock)
        history.add(
            snapshot(
                1, 1.0 + second, [topic(qos="urgent", queued=2, queue_ms=7.0)], [each],
                dropped={"tx_expired": dropped}, airtime_by_class_s={"urgent": 0.1 * second},
                control_airtime_s=0.02 * second, air_heard_pct=5.0,
            ),
            second,
        )  # fmt: skip
    assert lines(history, "snr") == {"robot 2 here": [20, 21, 22], "here at robot 2": [9, 9, 9]}
    assert lines(history, "loss")["robot 2 here"] == [10, 10, 10]
    air = {
        name: [v and round(v, 6) for v in values] for name, values in lines(history, "air").items()
    }
    assert air["urgent"] == [None, 10, 10]
    assert air["control"] == [None, 2, 2]
    assert air["heard"] == [5, 5, 5]
    assert lines(history, "wait")["urgent"] == [7, 7, 7]
    assert lines(history, "drops") == {"tx_expired": [None, 4, 0]}
    assert lines(history, "clock") == {"robot 2": [12, 12, 12]}


def test_a_daemon_that_is_away_leaves_a_gap_and_one_that_restarts_counts_anew():
    history = History()
    for second, found in enumerate(
        (snapshot(1, 90.0, dropped={"tx_expired": 50}), None,
         snapshot(1, 1.0, dropped={"tx_expired": 1}), snapshot(1, 2.0, dropped={"tx_expired": 3}))
    ):  # fmt: skip
        history.add(found, second)
    assert lines(history, "drops") == {"tx_expired": [None, None, None, 2]}
    assert lines(history, "queue")["bulk"] == [0, None, 0, 0]


@pytest.mark.slow
def test_it_is_bounded():
    history = History()
    for second in range(KEPT_S + 50):
        history.add(
            snapshot(neighbors=[neighbor(n, snr_db=1.0) for n in range(second % 200)]), second
        )
    assert len(history.times) == KEPT_S
    assert len(history.lines["snr"]) <= MOST_LINES
    assert {len(line) for found in history.lines.values() for line in found.values()} == {KEPT_S}


def test_pictures_are_drawn_of_it():
    history = History()
    history.add(snapshot(neighbors=[neighbor(2, snr_db=20.123)]), 7.0)
    (line,) = [each for each in series("snr", history) if each["name"] == "robot 2 here"]
    assert line["data"] == [(7000, 20.12)]
    for name, picture in PICTURES.items():
        assert empty_chart(picture)["tooltip"]["renderMode"] == "richText", "never as markup"
        assert isinstance(series(name, history), list)
    assert empty_waterfall()["tooltip"]["renderMode"] == "richText"
    assert waterfall(snapshot())["yAxis"] == {"data": []}


def test_a_browser_gets_only_what_is_new():
    history = History()
    for second in range(5):
        history.add(snapshot(neighbors=[neighbor(2, snr_db=20.0 + second)]), float(second))
    told = newest(history, 2000)
    assert [at_ms for at_ms, _ in told] == [3000, 4000]
    assert [values["snr"]["robot 2 here"] for _, values in told] == [23, 24]
    assert newest(history, 4000) == []
    # What was appended to what was there is the whole.
    whole = {each["name"]: each["data"] for each in series("snr", history)}
    appended = [(at_ms, values["snr"]["robot 2 here"]) for at_ms, values in newest(history, 0)]
    assert whole["robot 2 here"][1:] == appended
