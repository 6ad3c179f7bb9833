"""A drive is written, read again, and told on one page."""

import contextlib
import json
import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from sdrlinkd.cli import run
from sdrlinkd.drive import (
    DRIVE,
    Chronicle,
    DriveWriter,
    Event,
    read_drive,
    received,
    report_page,
    sent,
)
from sdrlinkd.errors import UserError
from sdrlinkd.reports import ReceivedTopicReport, VerdictReport
from tests.laws import law
from tests.reported import neighbor, snapshot, topic
from tests.web.odometry import ODOMETRY, odometry

SECOND_NS = 1_000_000_000
BEGIN_NS = 1_800_000_000 * SECOND_NS
HOSTILE = '<img src=x onerror="window.hurt=1">'


def report(second, uptime_s=None, level="OK", reason="", name="/odom"):
    """Robot 1 after so many seconds, in which it delivered 20 and lost one message a second."""
    heard = ReceivedTopicReport(
        src=2, topic_id=1, name=name, republished_as=f"/rx_robot_2{name}", delivered=20 * second,
        dropped={"rx_expired": second}, age_ms_p50=3.0, age_ms_p99=9.0,
    )  # fmt: skip
    found = snapshot(
        1, 1.0 + second if uptime_s is None else uptime_s, [topic(1, accepted=30 * second)],
        [neighbor(2, snr_db=20.0 - second, per_lately=0.1)], dropped={"tx_expired": 2 * second},
        received=[heard],
    )  # fmt: skip
    told = VerdictReport(level=level, reasons=[reason] if reason else [])
    return msgspec.structs.replace(found, verdict=told)


def write(folder, *reports):
    """A drive with these reports, one a second."""
    writer = DriveWriter(folder)
    for second, each in enumerate(reports):
        writer.status(each, BEGIN_NS + second * SECOND_NS)
    writer.close()
    return read_drive(folder)


def test_what_was_written_is_read(tmp_path):
    drive = write(tmp_path, *(report(second) for second in range(11)))
    station = drive.stations[1]
    assert drive.lasted_s == 10
    assert station.times == list(range(11))
    assert station.lines["snr"]["robot 2 here"] == [20 - second for second in range(11)]
    assert station.lines["drops"]["tx_expired"] == [None] + [2] * 10
    delivery = station.deliveries[2, "/odom"]
    assert (delivery.delivered, delivery.lost) == (200, 10)
    assert drive.pdr(1, 2, "/odom") == pytest.approx(200 / 210)
    assert station.dropped == {"tx_expired": 20}


def test_counters_of_several_starts_of_a_daemon_are_added(tmp_path):
    before = [report(second) for second in range(6)]
    after = [report(second, uptime_s=0.5 + second / 10) for second in range(4)]
    drive = write(tmp_path, *before, *after)
    assert drive.stations[1].deliveries[2, "/odom"].delivered == 100 + 60
    assert drive.stations[1].dropped["tx_expired"] == 10 + 6
    assert drive.stations[1].lines["drops"]["tx_expired"][6] is None, "not counted across a start"


def test_what_never_came_counts_where_the_sender_is_in_the_drive_too(tmp_path):
    writer = DriveWriter(tmp_path)
    writer.status(report(10), BEGIN_NS)
    sender = snapshot(2, 9.0, [topic(1, "/robot_2/odom", accepted=400)])
    writer.status(sender, BEGIN_NS)
    writer.close()
    assert read_drive(tmp_path).pdr(1, 2, "/odom") == 200 / 400


def test_paths_and_events_come_with_it(tmp_path):
    writer = DriveWriter(tmp_path)
    writer.status(report(0), BEGIN_NS)
    for step in range(5):
        at_ns = BEGIN_NS + step * SECOND_NS
        writer.message(sent(2, "/odom"), ODOMETRY, odometry(step, 1.0), at_ns)
        writer.message(received(1, 2, "/odom"), ODOMETRY, odometry(step, 2.0), at_ns)
    writer.message(received(1, 2, "/odom"), ODOMETRY, b"\0\1\0\0", BEGIN_NS)
    writer.event(Event(1, "warning", "robot 2 is far"), BEGIN_NS + 2 * SECOND_NS)
    writer.close()
    drive = read_drive(tmp_path)
    assert drive.paths == {
        (2, None): [(step, 1.0) for step in range(5)],
        (2, 1): [(step, 2.0) for step in range(5)],
    }
    assert [(at, event.text) for at, event in drive.events] == [(2.0, "robot 2 is far")]


def test_what_changes_is_told_once(tmp_path):
    writer = DriveWriter(tmp_path)
    chronicle = Chronicle(writer)
    for second in range(6):
        level = "DEGRADED" if second in (2, 3) else "OK"
        found = report(second, level=level, reason="robot 2 is far" if level != "OK" else "")
        chronicle.see(found, BEGIN_NS + second * SECOND_NS)
    chronicle.see(None, BEGIN_NS + 7 * SECOND_NS)
    chronicle.see(None, BEGIN_NS + 8 * SECOND_NS)
    writer.close()
    texts = [event.text for _, event in read_drive(tmp_path).events]
    verdicts = [each for each in texts if each.startswith(("OK", "DEGRADED"))]
    assert verdicts == ["OK", "DEGRADED: robot 2 is far", "OK"]
    assert texts.count("the daemon does not answer") == 1


def test_reports_are_a_second_apart_and_the_last_one_is_kept(tmp_path):
    writer = DriveWriter(tmp_path)
    chronicle = Chronicle(writer)
    for tenth in range(26):
        chronicle.see(report(tenth, uptime_s=tenth / 10), BEGIN_NS + tenth * SECOND_NS // 10)
    chronicle.end()
    chronicle.end()
    writer.close()
    assert read_drive(tmp_path).stations[1].times == [0.0, 0.9, 1.8, 2.5]


def test_it_can_be_read_up_to_the_last_sync_whatever_happens_then(tmp_path):
    writer = DriveWriter(tmp_path)
    for second in range(20):
        writer.status(report(second), BEGIN_NS + second * SECOND_NS)
        if second == 9:
            writer.sync()
            drive = read_drive(tmp_path)
            assert len(drive.stations[1].times) == 10
    assert len(read_drive(tmp_path).stations[1].times) == 10
    writer.close()
    assert len(read_drive(tmp_path).stations[1].times) == 20


def test_the_file_is_mcap_with_schemas(tmp_path):
    write(tmp_path, report(0), report(1))
    with (tmp_path / DRIVE).open("rb") as file:
        ((schema, channel, message),) = list(make_reader(file).iter_messages())[:1]
    assert (channel.topic, channel.message_encoding) == ("/sdrlink/robot_1/status", "json")
    assert schema.encoding == "jsonschema"
    assert set(json.loads(message.data)) == set(json.loads(schema.data)["properties"])
    # It holds in the clear what is sealed on the air.
    assert (tmp_path / DRIVE).stat().st_mode & 0o007 == 0


@pytest.mark.slow
def test_the_page_has_everything_and_names_are_text(tmp_path):
    reports = [
        report(second, level="DEGRADED", reason=f"robot 2 hears us at {second} dB", name=HOSTILE)
        for second in range(20)
    ]
    writer = DriveWriter(tmp_path)
    for second, each in enumerate(reports):
        writer.status(each, BEGIN_NS + second * SECOND_NS)
        place = odometry(math.cos(second), math.sin(second))
        writer.message(received(1, 2, "/odom"), ODOMETRY, place, BEGIN_NS + second * SECOND_NS)
    writer.event(Event(1, "info", HOSTILE), BEGIN_NS)
    writer.close()
    page = report_page(read_drive(tmp_path), HOSTILE)
    assert "<img src=x" not in page
    assert page.count("&lt;img src=x") >= 3
    assert page.count("data:image/png;base64,") == 3
    assert "robot 2 hears us at 0 dB" in page
    assert "100 %" in page
    assert "tx_expired: 38 messages, " in page
    assert "What helps: send it less often" in page
    assert "http" not in page.replace(HOSTILE, ""), "nothing is fetched from elsewhere"


@pytest.mark.slow
def test_report_writes_the_page_beside_the_drive(tmp_path, capsys):
    write(tmp_path, report(0), report(1))
    assert run(["report", str(tmp_path)]) == 0
    assert capsys.readouterr().out == f"wrote {tmp_path}/report.html\n"
    assert (tmp_path / "report.html").read_text().startswith("<!doctype html>")


@pytest.mark.parametrize("octets", [b"", b"not a drive", b"\x89MCAP0\r\n"])
def test_what_is_no_drive_is_refused_in_a_sentence(octets, tmp_path):
    with pytest.raises(UserError, match="No such file"):
        read_drive(tmp_path)
    (tmp_path / DRIVE).write_bytes(octets)
    with pytest.raises(UserError, match="allowed: a drive that"):
        read_drive(tmp_path)


def test_a_drive_is_not_written_over(tmp_path):
    write(tmp_path, report(0))
    with pytest.raises(UserError, match="is there already; give another folder"):
        DriveWriter(tmp_path)


@pytest.fixture(scope="module")
def octets(tmp_path_factory):
    """A whole drive."""
    folder = tmp_path_factory.mktemp("drive")
    write(folder, report(0), report(1))
    return (folder / DRIVE).read_bytes()


@law(200)
@given(st.data())
def test_a_damaged_file_is_read_or_refused_in_a_sentence(octets, tmp_path_factory, data):
    damaged = bytearray(octets)
    for at in data.draw(st.lists(st.integers(0, len(octets) - 1), max_size=4)):
        damaged[at] ^= data.draw(st.integers(1, 255))
    del damaged[data.draw(st.integers(0, len(octets))) :]
    path = tmp_path_factory.getbasetemp() / "damaged.mcap"
    path.write_bytes(damaged)
    with contextlib.suppress(UserError):
        read_drive(path)
