"""Another MCS, rate or policy on the last minute's traffic."""

import json
from math import inf

import msgspec
import pytest

from sdrlinkd.cli import run
from sdrlinkd.config import load_config
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.link import TopicPolicy
from sdrlinkd.plan import Load
from sdrlinkd.web.testing import Choice, foresee, loads_of, policy_of, traffic_of
from tests.reported import snapshot, topic

LOADS = [Load(1, "odom", 50.0, 700.0, 700.0), Load(2, "scan", 10.0, 4000.0, 4000.0)]
POLICIES = {1: {"qos": "urgent"}, 2: {"qos": "bulk", "lifespan_s": "inf"}}
CONFIG = """
namespace = "robot_1"
backend = "loopback"
[modem]
rate_hz = 2e6
mcs = 1
[topic.odom]
qos = "urgent"
[topic.scan]
qos = "bulk"
"""


@pytest.fixture
def config(tmp_path):
    (tmp_path / "registry.csv").write_text(
        "odom,nav_msgs/msg/Odometry\nscan,sensor_msgs/msg/LaserScan\n"
    )
    path = tmp_path / "sdrlinkd.toml"
    path.write_text(CONFIG)
    return path


@pytest.fixture
def traffic(config):
    return traffic_of(1, LOADS, 60.0, msgspec.to_builtins(load_config(config)), POLICIES)


def test_it_says_what_plan_says(config, traffic, capsys):
    run(
        [
            "plan",
            "--config",
            str(config),
            "--topic",
            "odom:50:700",
            "--topic",
            "scan:10:4000",
            "--json",
        ]
    )
    told = json.loads(capsys.readouterr().out)
    plan, outcomes = foresee(traffic, Choice())
    assert plan.air == pytest.approx(told["air"])
    found = {each.topic.name: each.topic.worst_s for each in outcomes}
    assert found == pytest.approx({each["name"]: each["worst_s"] for each in told["topics"]})


def test_what_is_chosen_counts(traffic):
    now, _ = foresee(traffic, Choice())
    faster, _ = foresee(traffic, Choice(mcs=5))
    wider, _ = foresee(traffic, Choice(rate_hz=8e6))
    rarer, _ = foresee(traffic, Choice(policies={1: {"period_s": 0.1}}))
    assert faster.air < now.air
    assert wider.air < now.air
    assert rarer.topics[0].rate_hz == pytest.approx(10)
    assert foresee(traffic, Choice(policies={2: {"qos": "urgent"}}))[0].topics[1].qos == "urgent"


def test_what_has_no_air_is_dropped_the_least_urgent_first(traffic):
    plan, outcomes = foresee(traffic, Choice(rate_hz=2.5e5))
    assert not plan.is_feasible
    by_name = {each.topic.name: each.dropped for each in outcomes}
    assert by_name["scan"] > 0
    assert by_name["scan"] >= by_name["odom"]
    urgent, bulk = (plan.air * t.air / sum(t.air for t in plan.topics) for t in plan.topics)
    carried = urgent * (1 - by_name["odom"]) + bulk * (1 - by_name["scan"])
    assert carried == pytest.approx(min(1.0, plan.air))


def test_what_cannot_be_is_said(traffic):
    with pytest.raises(UserError, match="--robots"):
        foresee(traffic, Choice(robots=99))
    with pytest.raises(ConfigError, match="of this version"):
        traffic_of(1, LOADS, 60.0, {"modem": {"mcs": "fast"}}, {})


def test_policies_come_with_infinity_as_a_word():
    assert policy_of({"lifespan_s": "inf", "qos": "bulk"}) == TopicPolicy(
        lifespan_s=inf, qos="bulk"
    )


def sending(second, before=0):
    """After so many seconds, in which 20 messages of 700 B a second were sent."""
    odom = topic(
        1, "odom", accepted=20 * second + before, accepted_per_s=20.0, accepted_bytes_per_s=14e3
    )
    return snapshot(uptime_s=10.0 + second, topics=[odom, topic(2, "quiet")])


def test_loads_are_means_of_the_reports():
    recent = [sending(second) for second in range(31)]
    loads, span_s = loads_of(recent)
    assert loads == [Load(1, "odom", 20.0, 700.0, 700.0)]
    assert span_s == 30
    assert loads_of([]) == ([], 0.0)
    assert loads_of(recent[:1])[0] == []


def test_only_what_came_since_a_restart_counts():
    recent = [*(sending(second, 9000) for second in range(31)), *(sending(s) for s in range(11))]
    assert loads_of(recent) == ([Load(1, "odom", 20.0, 700.0, 700.0)], 10)
