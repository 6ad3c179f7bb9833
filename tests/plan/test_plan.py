"""The plan, in numbers and in words."""

import re
from pathlib import Path
from random import Random

import pytest
from msgspec import structs

from sdrlinkd.cli import run
from sdrlinkd.config import parse_config
from sdrlinkd.errors import UserError
from sdrlinkd.link import TopicPolicy
from sdrlinkd.plan import Load, loads_from_bag, make_plan, parse_load, setting_of
from tests.laws import trials
from tests.plan.team import CONFIG, REGISTRY, setting

GOLDEN = Path(__file__).parent / "plan.txt"


def planned(*loads, policies=None, **how):
    known = {0: TopicPolicy(qos="latency"), 2: TopicPolicy(qos="bulk")}
    return make_plan(
        [parse_load(each, REGISTRY) for each in loads], policies or known, setting(**how)
    )


def test_shares_of_the_air_are_those_of_the_modem():
    plan = planned("scan:50:990", "map:5:64KiB")
    scan, image = plan.topics
    one_s = setting().airtimes.airtime_s(3, 1)
    assert (scan.pdus, image.pdus) == (1, 65)
    assert scan.air == pytest.approx(50 * one_s, rel=0.01)
    assert image.air == pytest.approx(5 * 65 * 8 * 1024 / 6e6, rel=0.08)
    assert plan.is_feasible
    assert plan.air == pytest.approx(scan.air + image.air)


def test_a_topic_below_its_share_has_a_bound_whatever_its_equals_offer():
    policies = {0: TopicPolicy(), 5: TopicPolicy()}
    alone, beside, worse = (
        planned("scan:10:1KB", *more, policies=policies).topics[0].worst_s
        for more in ((), ("map:50:64KiB",), ("map:500:64KiB",))
    )
    assert alone < beside == worse < 0.2
    heavy = planned("scan:10:1KB", "map:50:64KiB", policies=policies)
    assert heavy.topics[1].worst_s == float("inf")
    assert not heavy.is_feasible
    light = TopicPolicy(weight=0.01)
    starved = planned("scan:10:1KB", "map:50:64KiB", policies={0: light, 5: TopicPolicy()})
    assert starved.topics[0].worst_s == float("inf"), "its share is too small"


def test_what_is_more_urgent_waits_less_and_more_load_lets_others_wait_longer():
    few, many = planned("scan:10:1KB", "map:5:64KiB"), planned("scan:80:1KB", "map:5:64KiB")
    for plan in (few, many):
        assert plan.topics[0].worst_s < 0.02 < plan.topics[1].worst_s
    assert many.topics[1].worst_s > few.topics[1].worst_s


def test_too_much_is_not_feasible_and_says_what_to_change():
    plan = planned("scan:50:1KB", "map:20:64KiB")
    assert not plan.is_feasible
    assert plan.topics[1].worst_s == float("inf")
    assert plan.topics[0].worst_s < 0.02
    (advice,) = plan.advice
    assert "map takes the most" in advice
    assert "topic.map.period_s = 0.1" in advice


@pytest.mark.parametrize("seed", range(trials(12)))
def test_who_follows_the_advice_has_enough(seed):
    """For any policy, any robots and any largest topic."""
    rng = Random(seed)
    policy = rng.choice(["none", "tdma", "minislot", "csma"])
    how = {"policy": policy, "robots": 1 if policy == "none" else rng.randint(2, 4)}
    loads = [f"{name}:{rng.uniform(1, 50):.1f}:{int(10 ** rng.uniform(2, 4.3))}"
             for name in ("scan", "odom", "map")]  # fmt: skip
    known = {i: TopicPolicy(qos=rng.choice(["latency", "default", "bulk"])) for i in range(3)}
    plan = planned(*loads, policies=known, **how)
    told = dict(re.findall(r"topic\.(\w+)\.period_s = ([0-9.e+-]+)", " ".join(plan.advice)))
    if not told:
        assert plan.is_feasible or "raise its class" in plan.advice[0] or plan.air > 10
        return
    slowed = {
        i: structs.replace(known[i], period_s=float(told.get(REGISTRY.topics[i].name, 0)))
        for i in range(3)
    }
    again = planned(*loads, policies=slowed, **how)
    assert again.air <= 0.95
    assert all(topic.worst_s < float("inf") for topic in again.topics), (plan.advice, again)


def test_shares_in_the_advice_have_one_base():
    plan = planned("scan:50:1KB", "map:20:64KiB", policy="tdma", robots=3)
    total, largest = (int(each) for each in re.findall(r"(\d+) %", plan.advice[0])[:2])
    assert total == pytest.approx(100 * plan.air, abs=1)
    airs = [topic.air for topic in plan.topics]
    assert largest / total == pytest.approx(max(airs) / sum(airs), abs=0.01)


def test_what_no_rate_mends_is_told():
    plan = planned("scan:60000:1KB", "map:2000:64KiB")
    assert "fewer robots" in plan.advice[0]
    assert "period_s" not in plan.advice[0]


def test_a_lifespan_that_cannot_be_met_is_told():
    policies = {0: TopicPolicy(qos="bulk", lifespan_s=0.02), 2: TopicPolicy(qos="latency")}
    plan = planned("scan:5:1KB", "map:5:64KiB", policies=policies)
    assert not plan.is_feasible
    assert "scan can take" in plan.advice[0]
    assert "expires after 20 ms" in plan.advice[0]


def test_policies_count():
    policies = {0: TopicPolicy(period_s=0.1), 1: TopicPolicy(decimate=5)}
    plan = planned("scan:50:1KB", "odom:30:724", policies=policies)
    assert [topic.rate_hz for topic in plan.topics] == [10, 6]


@pytest.mark.parametrize("policy", ["csma", "minislot", "tdma", "grant"])
def test_robots_that_share_the_air_wait_for_each_other(policy):
    alone, three = (planned("scan:20:1KB", policy=policy, robots=robots) for robots in (1, 3))
    assert three.air > 2.5 * alone.air
    assert three.topics[0].worst_s > 2 * alone.topics[0].worst_s


def test_rates_and_sizes_from_a_recording():
    messages = [("/robot_1/odom", 0.1 * i, bytes(600 + i)) for i in range(11)]
    messages += [("/other", 0.0, b"")]
    (load,), left_out = loads_from_bag(messages, REGISTRY, {})
    assert left_out == [("/other", 1, "not in the registry")]
    assert load == Load(1, "odom", pytest.approx(10), 605, 610)
    (small,), _ = loads_from_bag(messages, REGISTRY, {1: TopicPolicy(compress="zstd")})
    assert small.size < 100


def test_what_of_a_recording_is_not_planned_is_listed():
    messages = [
        (name, 0.1 * i, bytes(100)) for i in range(3) for name in ("/fix", "/scan", "/odom")
    ]
    loads, left_out = loads_from_bag(messages, REGISTRY, {}, ["/odom"])
    assert [load.name for load in loads] == ["odom"]
    assert left_out == [
        ("/fix", 3, "not in the registry"),
        ("/scan", 3, "not selected by the key `topics`"),
    ]


def test_the_worst_case_is_that_of_the_largest_message():
    same, larger = (Load(0, "scan", 20.0, 1000.0, most) for most in (1000.0, 20_000.0))
    one, other = (make_plan([load], {}, setting()).topics[0] for load in (same, larger))
    assert one.air == other.air
    assert other.worst_s > 2.5 * one.worst_s


@pytest.mark.parametrize("text", ["scan", "scan:50", "scan:0:1", "scan:fast:1KB", "scan:5:1parsec"])
def test_a_load_that_cannot_be_read_is_refused(text):
    with pytest.raises(UserError, match=r"allowed: (NAME:RATE:SIZE|a size such as)"):
        parse_load(text, REGISTRY)
    with pytest.raises(UserError, match="did you mean scan"):
        parse_load("scam:5:1KB", REGISTRY)


def plan_text(tmp_path, capsys, *topics):
    (tmp_path / "registry.csv").write_text(REGISTRY.csv())
    (tmp_path / "c.toml").write_text(CONFIG.format(policy="none"))
    options = [each for topic in topics for each in ("--topic", topic)]
    code = run(["plan", "--config", str(tmp_path / "c.toml"), *options])
    return code, capsys.readouterr()


@pytest.mark.slow
def test_the_plan_reads_like_this(tmp_path, capsys):
    code, told = plan_text(tmp_path, capsys, "scan:50:990", "odom:30:724", "map:6.67:64KiB")
    assert code == 0
    assert told.out == GOLDEN.read_text()
    code, told = plan_text(tmp_path, capsys, "map:20:64KiB")
    assert code == 1
    assert "NOT feasible" in told.out


def test_a_plan_without_an_air_is_refused():
    with pytest.raises(UserError, match="has no channel"):
        setting_of(parse_config(""), 1)
