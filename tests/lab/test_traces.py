"""Outages out of logs: where messages are missing, whatever the log looks like."""

import json
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest

from backends import Outage
from sdrlinkd.errors import UserError
from sdrlinkd.lab import load_scenario
from sdrlinkd.lab.scenario import outages_of
from sdrlinkd.lab.traces import read_outages

SHARED = Path(__file__).parents[3] / "shared" / "data"
SHIPYARD = "log_ax_high_ax_160mhz_6ghz_loc4_robot_control.jsonl"
QUIET = "log_perama_site_ac_80mhz_5ghz_run1_loc2.jsonl"
PERIOD_S = 0.5


@pytest.fixture
def outages(tmp_path):
    """Outages of a log of these lines; a number is one with that sequence number."""

    def call(lines, from_s=0.0, period_s=PERIOD_S):
        path = tmp_path / "log.jsonl"
        path.write_bytes(b"".join(_line(each) + b"\n" for each in lines))
        return [tuple(each) for each in read_outages(path, period_s, from_s)]

    return call


def _line(given):
    if isinstance(given, int):
        given = json.dumps({"timestamp": 1, "payload": {"seqnum": given, "runid": "run1"}})
    return given if isinstance(given, bytes) else given.encode()


def test_what_is_missing_is_an_outage(outages):
    assert outages([7, 8, 10, 11, 15, 16]) == [(1.0, 1.5), (2.5, 4.0)]
    assert outages([7, 8, 10], period_s=0.1) == [(pytest.approx(0.2), pytest.approx(0.3))]


def test_nothing_missing_is_no_outage(outages):
    assert outages([7, 8, 9, 10]) == []


def test_order_and_copies_do_not_matter(outages):
    lines = [7, 8, 10, 11, 15, 16]
    expected = outages(lines)
    shuffled = [*lines, 8, 8, 15]
    Random(3).shuffle(shuffled)
    assert shuffled != sorted(shuffled)
    assert outages(shuffled) == expected


def test_the_number_may_stand_at_the_top(outages):
    assert outages(['{"seqnum": 7}', '{"seqnum": 9, "rtt_ms": 3}', 10]) == [(0.5, 1.0)]
    assert outages(['{"seqnum": 7}', '{"seqnum": 8, "payload": "hello"}', 9]) == []


@pytest.mark.parametrize(
    "damage",
    [
        "",
        "{",
        '{"payload": {"seqnum": 9',
        '{"payload": {"seqnum": "9"}}',
        '{"payload": {"seqnum": 9.0}}',
        '{"payload": {"seqnum": null}}',
        '{"payload": {"number": 9}}',
        '{"payload": null}',
        '{"payload": [9]}',
        '{"seqnum": true}',
        "[9]",
        "9",
        '"seqnum"',
        "null",
        b"\xff\xfe\x00\x80",
        '{"seqnum": ' + "9" * 5000 + "}",
        "[" * 100_000,
    ],
)
def test_a_damaged_line_tells_nothing(outages, damage):
    assert outages([7, 8, damage, 10, 11]) == outages([7, 8, 10, 11]) == [(1.0, 1.5)]


def test_no_number_is_too_large_to_count_with(outages):
    far = '{"seqnum": 1' + "0" * 400 + "}"
    try:
        found = outages([7, 8, far])
    except UserError:
        return
    assert all(begin >= 0 for begin, _ in found)


@pytest.mark.parametrize("seed", range(20))
def test_any_bytes_are_read_or_refused_in_words(outages, seed):
    rng = Random(seed)
    good = b"\n".join(_line(number) for number in range(40))
    octets = bytearray(good)
    for _ in range(rng.randrange(1, 200)):
        octets[rng.randrange(len(octets))] = rng.randrange(256)
    try:
        found = outages([bytes(octets)])
    except UserError:
        return
    assert all(0 <= begin < end for begin, end in found), seed


@pytest.mark.parametrize(
    ("from_s", "expected"),
    [
        (0.0, [(1.0, 1.5), (3.0, 5.0)]),
        (1.0, [(0.0, 0.5), (2.0, 4.0)]),
        (1.25, [(0.0, 0.25), (1.75, 3.75)]),
        (1.5, [(1.5, 3.5)]),
        (4.0, [(0.0, 1.0)]),
        (5.0, []),
        (1e6, []),
    ],
)
def test_the_run_begins_somewhere_in_the_log(outages, from_s, expected):
    assert outages([7, 8, 10, 11, 12, 17], from_s) == expected


@pytest.mark.parametrize("lines", [[], [7], [7, 7], ["nothing", "at all"]])
def test_a_log_that_tells_nothing_is_refused(outages, lines):
    with pytest.raises(UserError) as error:
        outages(lines)
    assert "log.jsonl: holds no two lines with a seqnum" in str(error.value)
    assert "allowed: a log of received messages" in str(error.value)


def test_a_log_that_cannot_be_read_is_refused(tmp_path):
    for path in (tmp_path / "none.jsonl", tmp_path):
        with pytest.raises(UserError) as error:
            read_outages(path, PERIOD_S, 0.0)
        assert f"{path}: cannot be read" in str(error.value)
        assert "--traces names the folder" in str(error.value)


def test_a_scenario_with_a_trace_needs_the_folder(tmp_path):
    (tmp_path / "s.toml").write_text(
        '[[robot]]\nid = 1\n[outages]\ntrace = "a.jsonl"\nperiod_s = 2\nfrom_s = 2\n'
        "times = [[20, 21]]\n"
    )
    (tmp_path / "a.jsonl").write_bytes(b"\n".join(_line(number) for number in (3, 4, 6)))
    scenario = load_scenario(tmp_path / "s.toml")
    with pytest.raises(UserError, match=r"outages of a\.jsonl.*--traces"):
        outages_of(scenario, None)
    with pytest.raises(UserError, match="cannot be read"):
        outages_of(scenario, tmp_path / "elsewhere")
    assert outages_of(scenario, tmp_path) == [Outage(20, 21), Outage(2, 4)]


def test_without_a_trace_no_folder_is_asked_for(tmp_path):
    (tmp_path / "s.toml").write_text("[[robot]]\nid = 1\n[outages]\ntimes = [[1, 2], [4, 5]]\n")
    assert outages_of(load_scenario(tmp_path / "s.toml"), None) == [Outage(1, 2), Outage(4, 5)]


def recorded(name):
    path = SHARED / "traces" / name
    if not path.exists():
        pytest.skip("the logs are not part of the project; see ../shared/data")
    numbers = [json.loads(line)["payload"]["seqnum"] for line in path.read_text().splitlines()]
    return path, (max(numbers) - min(numbers) + 1) * PERIOD_S


def test_the_shipyards_outages_are_those_of_its_log():
    path, span_s = recorded(SHIPYARD)
    found = read_outages(path, PERIOD_S, 0.0)
    lost_s = sum(end - begin for begin, end in found)
    assert 0.30 < lost_s / span_s < 0.35
    assert max(end - begin for begin, end in found) > 10
    assert all(0 <= begin < end <= span_s for begin, end in found)
    assert all(one.end_s < other.begin_s for one, other in pairwise(found))
    # The shipped scenario's part of it.
    scenario = load_scenario(Path(__file__).parents[2] / "etc/scenarios/shipyard-outage.toml")
    world = scenario.world(outages_of(scenario, path.parent))
    tenths = [world.is_out(t / 10) for t in range(round(10 * scenario.duration_s))]
    assert 0 < sum(tenths) < len(tenths)


def test_a_log_without_losses_has_no_outages():
    path, span_s = recorded(QUIET)
    assert span_s > 100
    assert read_outages(path, PERIOD_S, 0.0) == []
