"""Every table at three widths: no figure is cut, and nothing is wider than the screen."""

import re
from importlib import import_module

import msgspec
import pytest
from rich.text import Text

from backends import Assessment, DeviceProbe, DirectionProbe
from benchmarks.report import Row, table_of
from sdrlinkd.adapters import BagSummary, TopicSummary
from sdrlinkd.cli import bag, phy, plan, radio, topics
from sdrlinkd.cli.screens import StatusScreen, daemons_table, latency_screen
from sdrlinkd.demo import RunResult, TopicResult, table_6, topic_table
from sdrlinkd.iq import modem_info
from sdrlinkd.lab import LabState, live_table, pair_table
from sdrlinkd.plan import Plan, TopicPlan, Worst
from sdrlinkd.tables import FittedTable, bar, figure, words, wrapped
from tests.cli.pictures import assert_stored, drawn
from tests.cli.snapshots import LONG, SNAPSHOT, busy
from tests.lab.reports import lost, pair, report, robot

WIDTHS = (80, 100, 140)
ODOMETRY = "nav_msgs/msg/Odometry"
LATENCY = {"p50": 347.25, "p90": 400.0, "p99": 2144.67, "max": 3000.0}

SUMMARY = BagSummary(
    pause_s=0.0,
    duration_s=3600.0,
    n_messages=1_234_567,
    n_bytes=10**11,
    topics=[
        TopicSummary(f"/{LONG}", "sensor_msgs/msg/Image", 1_234_567, 342.93, 921_664.0, 12_921_664)
    ],
)


def run(kind: str, topic: str) -> RunResult:
    """An invented run of the demonstration."""
    heard = TopicResult(
        name=topic, type=ODOMETRY, sent=3982, received=3341, pdr=0.839,
        goodput_bytes_per_s=21763.4, latency_ms=LATENCY, path_error_m=0.0012,
    )  # fmt: skip
    return RunResult(
        name=kind, source="husky.bag", seed=1, pdu_size=64, duration_s=3815.4, sent=398_200,
        received=334_100, pdr=0.839, goodput_bytes_per_s=1_725_329.5, latency_ms=LATENCY,
        path_error_m=0.0012, bytes_identical=True, entries_per_message=16.6, pdus_sent=17_483,
        ledger_adds_up=True, dropped={}, topics=[heard], left_out=[], damage="",
    )  # fmt: skip


def planned(topic: str) -> Plan:
    """An invented plan."""
    topics_of = [
        TopicPlan(
            topic, "latency", 123.4, 65536.0, 6500, 0.613, Worst(8, 2, 2.3, 0.0456), 1.0, 34.94
        ),
        TopicPlan(
            "odom", "default", 30.0, 724.0, 1, 0.045, Worst(0.001, 0.002, 0.003, 0.0009), 2.0, 0.174
        ),
    ]
    notes = [
        "3 robots, 5 Msps, access tdma, as configured; 86 % of the airtime is usable",
        "each worst case includes: lead 20.5 ms, reception 3 ms, hosts 10 ms (--host)",
    ]
    return Plan(topics_of, [], 0.658, True, [], robots=3, policy="tdma", notes=notes)


def probed(device: str) -> tuple[DeviceProbe, Assessment]:
    """An invented radio."""
    way = msgspec.convert(
        {
            "rates_hz": [(1e6 * i, 1e6 * i + 5e5) for i in range(1, 9)],
            "frequencies_hz": [(1e6, 7.25e9)], "gain_db": (0, 116),
            "gains_db": {"AMP": (0, 14), "LNA": (0, 40)}, "antennas": ["TX/RX"],
            "formats": ["CF32"], "transfer": 131_072,
        },
        DirectionProbe,
    )  # fmt: skip
    found = DeviceProbe(device=device, label=device, driver="hackrf", rx=way, tx=way)
    return found, Assessment(
        "at 2 Msps", 2e6, 2, 0.0655, 0.25, 0.05, ["this one is only half duplex"]
    )


def bench_rows() -> list[Row]:
    """Invented rows of a benchmark."""
    peers = {"blocking_receive_only": 256_300.0, "zmq_asyncio_receive_only": 74_710.0}
    return [Row("path_cost_over_crc_and_join_1024B", 2.677, "ratio", 4.0, "less", 180, peers)]


def everything(width: int) -> dict[str, list[object]]:
    """Each command's tables, full of long names and large figures."""
    at = busy()
    state = LabState(123.4, 1000, [busy(i) for i in range(3)])
    few = report(title=LONG, pairs=[pair(1, 2, sent=398_200, received=334_100), lost(2, 1)])
    many = report(
        robots=[robot(i) for i in range(1, 7)],
        pairs=[pair(i, j) for i in range(1, 7) for j in range(1, 7) if i != j],
    )
    listed = [
        (f"/run/user/1000/{LONG}", 12345, at), ("/run/sdrlinkd", 1, SNAPSHOT),
        ("/run/other", None, "no answer"),
    ]  # fmt: skip
    return {
        "status": [StatusScreen(at, 24), StatusScreen(at, None)],
        "latency": latency_screen(at.link, at.link.received, whole=True),
        "demo": [table_6([run("ofdm", LONG), run("direct", "odom")]), topic_table(run("x", LONG))],
        "lab": [live_table(LONG, state), pair_table(few), pair_table(many)],
        "plan": [*plan.lines(planned(LONG))],
        "phy info": [phy.table_of(modem_info(5e6, 1024, 0.005))],
        "radio probe": [radio.table_of(*probed(f"driver=hackrf,serial={LONG}"), 2e6)],
        "bag info": [bag.table_of(SUMMARY)],
        "topics": [*topics.tables(at.link)],
        "list": [daemons_table(listed, 80)],
        "bench": [table_of("path_cost", bench_rows())],
    }


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("command", everything(80))
def test_no_figure_is_cut_and_nothing_is_wider_than_the_screen(command, width):
    text = drawn(*everything(width)[command], width=width)
    assert re.search(r"\d", text)
    for line in text.splitlines():
        assert len(line) <= width, line
        for cell in re.split(r"\s{2,}", line):
            assert not ("…" in cell and re.search(r"\d", cell)), line


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("command", everything(80))
def test_every_figure_stays_whole_on_its_line(command, width):
    """A table that wraps a figure would leave an empty cell at the start of the row."""
    for table in everything(width)[command]:
        if not isinstance(table, FittedTable):
            continue
        for place, n in table.widths(width).items():
            if table.columns[place].kind == "figure":
                for cells, _ in table.rows:
                    cell = cells[place]
                    assert len(cell.plain if isinstance(cell, Text) else cell) <= n


def test_screens_of_80_by_24_are_the_stored_ones():
    few = report(title="Two small robots", pairs=[pair(1, 2), lost(2, 1)])
    robots = LabState(12.5, 20, [SNAPSHOT, busy()])
    at = busy()
    heard = at.link.received[0:8:3]
    link = msgspec.structs.replace(at.link, neighbors=at.link.neighbors[:2])
    screens = {
        "demo": [table_6([run("ofdm", "odom"), run("direct", "odom")])],
        "lab": [live_table("Two small robots", robots), pair_table(few)],
        "latency": latency_screen(link, heard, whole=False),
        "plan": plan.lines(planned("map")),
    }
    for name, parts in screens.items():
        text = drawn(*parts)
        assert len(text.splitlines()) <= 24, name
        assert_stored(name, text)


def test_the_least_important_column_leaves_first_and_names_wrap():
    table = FittedTable("", (words("topic"), figure("age"), figure("p99", 1), bar("", 2)))
    table.add("/camera/image_raw/compressed", "12.35", "250.1", lambda width: Text("x" * width))
    kept = {width: [*table.widths(width)] for width in (80, 36, 28, 20)}
    assert kept == {80: [0, 1, 2, 3], 36: [0, 1, 2], 28: [0, 1, 2], 20: [0, 1]}
    assert "12.35" in drawn(table, width=20)
    assert "250.1" in drawn(table, width=28)
    assert table.heights(80) == [1]
    assert table.heights(28) == [3]


def test_names_break_where_they_have_parts():
    assert wrapped("/camera/image_raw", 8) == "/camera\n/image_\nraw"
    assert wrapped("abcdefghij", 4) == "abcd\nefgh\nij"
    assert wrapped("one two three", 7) == "one two\nthree"


def test_a_row_has_a_cell_for_each_column():
    with pytest.raises(ValueError, match="1 cells for 2 columns"):
        FittedTable("", (words("a"), words("b"))).add("x")


@pytest.mark.parametrize(("columns", "wide"), [(None, 100), ("80", 80), ("132", 132)])
def test_what_is_no_terminal_is_100_wide_or_as_columns_says(monkeypatch, columns, wide):
    monkeypatch.delenv("COLUMNS", raising=False)
    if columns:
        monkeypatch.setenv("COLUMNS", columns)
    assert import_module("sdrlinkd.tables").screen_console().width == wide
