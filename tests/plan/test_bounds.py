"""The longest wait for the air is never exceeded, and the screen and programs get it."""

import json

import pytest

from benchmarks.team.worst import strain
from sdrlinkd.cli import run
from sdrlinkd.config import parse_config
from sdrlinkd.errors import UserError
from sdrlinkd.plan import bounds_of, setting_of
from tests.laws import one_in
from tests.plan.team import CONFIG, REGISTRY


def bounds(policy, *robots):
    return bounds_of(parse_config(CONFIG.format(policy=policy)), 1, robots, 1e-4)[0]


@pytest.mark.slow
@pytest.mark.parametrize("policy", one_in(4, ["tdma", "minislot", "auction", "grant"]))
@pytest.mark.parametrize(("n", "duration_s"), one_in(3, [(8, 4.0), (2, 6.0), (24, 2.5)]))
def test_no_urgent_message_waits_longer_than_planned(policy, n, duration_s):
    """All robots have more to send than fits; one PDU in twenty is lost; robots come and go."""
    told = strain(policy, n, 2, duration_s)
    assert told.n
    assert told.broken == 0, told


@pytest.mark.long
def test_a_bound_without_one_of_its_terms_is_broken():
    told = strain("auction", 8, 1, 8.0, is_calm=True)
    assert told.broken == 0
    # At the begin, robots listen for a round.
    assert told.in_outages < 0.05 * told.n
    # A contest takes longer than what is left.
    assert told.longest_s > 0.85 * told.bound_s


@pytest.mark.parametrize("policy", ["minislot", "tdma", "grant", "auction", "csma"])
def test_more_robots_and_less_urgent_classes_wait_longer(policy):
    few, many = bounds(policy, 4), bounds(policy, 24)
    assert [each.qos for each in few] == ["urgent", "latency", "default", "bulk"]
    for one, other in zip(few, many, strict=True):
        assert one.first_s < other.first_s
        assert one.all_s < other.all_s
    for found in (few, many):
        assert all(each.first_s <= each.all_s for each in found)


def test_the_wait_of_an_auction_grows_with_the_logarithm_of_robots():
    eight, sixteen, thirty_two = (bounds("auction", n)[0].first_s for n in (8, 16, 32))
    assert thirty_two - sixteen == pytest.approx(sixteen - eight)
    assert thirty_two < 1.5 * eight
    assert bounds("tdma", 32)[0].first_s > 3 * bounds("tdma", 8)[0].first_s


def test_too_many_robots_are_refused():
    config = parse_config(CONFIG.format(policy="tdma"))
    with pytest.raises(UserError, match=r"--robots: got 33; allowed: 1 to 32"):
        setting_of(config, 1, 33)
    nodes = str(list(range(1, 41)))
    many = parse_config(CONFIG.format(policy="tdma").replace("[1, 2, 3]", nodes))
    with pytest.raises(UserError, match=r"access\.nodes: got 40 robots; allowed in a plan"):
        setting_of(many, 1)


def told(tmp_path, capsys, policy, *options):
    (tmp_path / "registry.csv").write_text(REGISTRY.csv())
    (tmp_path / "c.toml").write_text(CONFIG.format(policy=policy))
    code = run(["plan", "--config", str(tmp_path / "c.toml"), *options])
    return code, capsys.readouterr()


@pytest.mark.slow
def test_the_waits_come_with_the_robots_of_the_configuration(tmp_path, capsys):
    code, said = told(tmp_path, capsys, "tdma")
    assert code == 0
    assert "longest wait for the air" in said.out
    assert "no topics to plan" in said.out
    _, said = told(tmp_path, capsys, "tdma", "--json")
    found = json.loads(said.out)["bounds"]
    assert [each["robots"] for each in found] == [3] * 4
    assert all(each["first_s"] > 0 for each in found)


@pytest.mark.slow
def test_there_is_one_worst_case_and_its_parts_add_up(tmp_path, capsys):
    _, said = told(tmp_path, capsys, "tdma", "--topic", "scan:5:100", "--json")
    found = json.loads(said.out)
    assert found["bounds"] == []
    (topic,) = found["topics"]
    assert sum(topic["worst"].values()) == pytest.approx(topic["worst_s"])
    assert all(part >= 0 for part in topic["worst"].values())
    assert topic["p99_s"] is None
    _, said = told(tmp_path, capsys, "tdma", "--topic", "scan:5:100")
    assert said.out.splitlines()[0].endswith(": feasible")
    assert "longest wait for the air" not in said.out


@pytest.mark.parametrize(
    ("policy", "options", "words"),
    [
        ("none", ("--robots", "1..8"), "the access policy is none, which has no longest wait"),
        ("tdma", ("--robots", "1..8", "--topic", "scan:5:100"), "with topics; allowed: one number"),
        ("tdma", ("--team", "--topic", "scan:5:100"), "--topic: given with --team"),
        ("tdma", ("--team", "--robots", "3"), "--robots: given with --team"),
    ],
)
def test_what_would_be_ignored_is_refused(tmp_path, capsys, policy, options, words):
    code, said = told(tmp_path, capsys, policy, *options)
    assert (code, words in said.err) == (2, True), said.err


@pytest.mark.slow
def test_a_range_of_robots_gives_a_curve(tmp_path, capsys):
    _, said = told(tmp_path, capsys, "tdma", "--robots", "1..32", "--json")
    found = json.loads(said.out)["bounds"]
    assert sorted({each["robots"] for each in found}) == list(range(1, 33))
    for wrong in ("33", "0", "5..2", "2..40", "x", "1..2..3", "..", "-1"):
        code, said = told(tmp_path, capsys, "tdma", f"--robots={wrong}")
        assert (code, "allowed: 1 to 32" in said.err) == (2, True), wrong


def test_whoever_lists_nobody_is_told_what_is_planned():
    config = parse_config(CONFIG.format(policy="auto").replace("[1, 2, 3]", "[]"))
    setting = setting_of(config, 1)
    assert setting.robots == 1
    assert "planned for one robot" in setting.notes[0]
