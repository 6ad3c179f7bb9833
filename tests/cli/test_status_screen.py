"""The status screen: its content, that it fits, and that it says what it leaves out."""

import re

import msgspec
import pytest

from sdrlinkd.cli.screens import StatusScreen
from sdrlinkd.cli.status import ledger_lines
from sdrlinkd.reports import VerdictReport
from tests.cli.pictures import assert_stored, drawn
from tests.cli.snapshots import LONG, SNAPSHOT, busy


def screen(snapshot, width=80, height=24):
    return drawn(StatusScreen(snapshot, height), width=width)


def test_the_screen_is_the_stored_one():
    assert_stored("status", screen(SNAPSHOT))


def test_the_screen_of_a_busy_daemon_is_the_stored_one():
    assert_stored("status-busy", screen(busy()))


def test_everything_is_the_stored_one():
    assert_stored("status-all", screen(SNAPSHOT, height=None))


@pytest.mark.parametrize("height", [12, 16, 24, 40, 60])
@pytest.mark.parametrize("width", [80, 100, 140])
@pytest.mark.parametrize("snapshot", [SNAPSHOT, busy()], ids=["quiet", "busy"])
def test_it_fits_whatever_there_is(snapshot, width, height):
    lines = screen(snapshot, width, height).splitlines()
    assert len(lines) <= height
    assert max(map(len, lines)) <= width


def test_what_is_left_out_is_counted():
    snapshot = busy()
    *shown, last = screen(snapshot).splitlines()
    told = re.fullmatch(r"\+ (\d+) topics, (\d+) robots, 5 notes, \d more lines: --all", last)
    rows = [line for line in shown if line.startswith("/r")]
    busy_topics = 11 + 8 * 2
    assert int(told[1]) == busy_topics - len(rows)
    robots = [line for line in shown if re.match(r"\d +\d", line)]
    assert int(told[2]) == 8 - len(robots)
    whole = screen(snapshot, height=None)
    assert "--all" not in whole
    for part in ("/robot_1/topic_14", "note number 3", "tx_unknown_topic", "robot 9 hears us"):
        assert part in whole


def test_the_worst_come_first():
    lines = screen(busy(), 140, 60).splitlines()
    robots = [line.split()[0] for line in lines if re.match(r"\d +\d", line)]
    # Robots with another registry come first, then the order is by loss.
    assert robots == ["5", "9", "8", "7", "6", "4", "3", "2"]
    sent = [line.split()[0] for line in lines if line.startswith("/robot_1")]
    assert sent[:2] == ["/robot_1/topic_9", "/robot_1/topic_7"]


def test_what_is_idle_takes_one_line():
    text = screen(busy(), 140)
    (idle,) = re.findall(r"^idle .*", text, re.MULTILINE)
    assert "topic_11, topic_12, topic_13, topic_14" in idle
    assert not re.search(r"^/robot_1/topic_1[1-4]", text, re.MULTILINE)


@pytest.mark.parametrize(("level", "reasons", "line"), [
    ("OK", [], "OK, sealed"),
    ("DOWN", ["no radio since 12 s"], "DOWN, sealed: no radio since 12 s"),
    ("DEGRADED", ["robot 2 hears us at 3 dB, 4 % lost", "b"],
     "DEGRADED, sealed: robot 2 hears us at 3 dB, 4 % lost; b"),
])  # fmt: skip
def test_line_1_is_the_verdict(level, reasons, line):
    told = VerdictReport(level=level, protection="sealed", reasons=reasons)
    text = screen(msgspec.structs.replace(SNAPSHOT, verdict=told))
    assert text.splitlines()[0] == line


def test_line_1_says_that_nothing_is_sealed():
    told = msgspec.structs.replace(SNAPSHOT, verdict=VerdictReport())
    assert screen(told).splitlines()[0] == "OK, in the clear"


def test_a_long_name_is_whole_in_the_end():
    text = "".join(screen(busy(), height=None).split())
    assert LONG.rsplit("/", 1)[-1] in text


def test_the_ledger_in_words():
    assert ledger_lines(SNAPSHOT.link) == [
        "messages out: 130 = 110 sent + 12 queued + 2 in flight + 1 tx_bad_envelope + 5 tx_expired",
        "PDUs heard: 800 = 780 used + 15 rx_control + 5 rx_crc",
        "messages in: 104 = 100 delivered + 1 held + 3 rx_partial_timeout",
    ]
