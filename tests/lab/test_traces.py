"""Outages from logs: where messages are missing, whatever the log looks like."""

import json
from itertools import pairwise
from random import Random

import pytest

from backends import Outage
from sdrlinkd.errors import UserError
from sdrlinkd.lab import load_scenario
from sdrlinkd.lab.testing import outages_of, read_outages
from tests.lab.scenarios import SHIPPED

SHIPYARD = "log_ax_high_ax_160mhz_6ghz_loc4_robot_control.jsonl"
PERIOD_S = 0.5


@pytest.fixture
def outages(tmp_path):
    """Outages of a log with these lines; a number is a line with that sequence number."""

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
    assert "log.jsonl: has fewer than two lines with a seqnum" in str(error.value)
    assert "allowed: a log of received messages" in str(error.value)


def test_a_log_that_cannot_be_read_is_refused(tmp_path):
    for path in (tmp_path / "none.jsonl", tmp_path):
        with pytest.raises(UserError) as error:
            read_outages(path, PERIOD_S, 0.0)
        assert f"{path}: cannot be read" in str(error.value)
        assert "give the folder of the logs" in str(error.value)


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


def log_of(path, states):
    """Write a log of one message per period, lost where `states` is True; returns its times."""
    lines = [_line(number + 1000) for number, is_lost in enumerate(states) if not is_lost]
    path.write_bytes(b"".join(line + b"\n" for line in lines))
    edges = [i for i in range(1, len(states)) if states[i] != states[i - 1]]
    return [(begin * PERIOD_S, end * PERIOD_S) for begin, end in pairwise(edges) if states[begin]]


def shipyard(seed, n):
    """Losses of a robot between ships: a third, some single, some for many seconds."""
    rng = Random(seed)
    states = [False]
    while len(states) < n:
        states += [True] * (rng.choice((1, 1, 2)) if rng.random() < 0.8 else rng.randint(20, 40))
        states += [False] * rng.randint(1, 25)
    return [*states[:n], False]


@pytest.mark.parametrize("seed", range(5))
def test_outages_of_a_long_log_are_the_runs_of_what_is_lost(tmp_path, seed):
    states = shipyard(seed, 400)
    expected = log_of(tmp_path / SHIPYARD, states)
    assert read_outages(tmp_path / SHIPYARD, PERIOD_S, 0.0) == [Outage(*each) for each in expected]
    lost_s = sum(end - begin for begin, end in expected)
    assert lost_s == PERIOD_S * sum(states)
    assert 0.15 < lost_s / (PERIOD_S * len(states)) < 0.6
    assert max(end - begin for begin, end in expected) >= 10
    # The part of it in the shipped scenario.
    scenario = load_scenario(SHIPPED / "shipyard-outage.toml")
    world = scenario.world(outages_of(scenario, tmp_path))
    periods = range(round(scenario.duration_s / PERIOD_S))
    assert [world.is_out((t + 0.5) * PERIOD_S) for t in periods] == states[: len(periods)]


def test_a_log_without_losses_has_no_outages(tmp_path):
    assert log_of(tmp_path / "quiet.jsonl", [False] * 400) == []
    assert read_outages(tmp_path / "quiet.jsonl", PERIOD_S, 0.0) == []
