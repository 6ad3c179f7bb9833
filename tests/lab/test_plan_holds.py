"""Compares the plan with the outcome, in virtual time.

Nothing arrives later than planned, and traffic that fills the air arrives not much sooner.
"""

from random import Random

import numpy as np
import pytest

from backends import AirParams, RadioParams, World
from benchmarks.worlds.arrivals import Arrival
from benchmarks.worlds.bursts import Simulation
from sdrlinkd.config import ModemParams
from sdrlinkd.link import (
    AccessParams,
    ClassesParams,
    Link,
    LinkParams,
    QueueParams,
    ReassemblyParams,
    TopicPolicy,
)
from sdrlinkd.modem import Airtimes
from sdrlinkd.plan import Load, Setting, make_plan
from sdrlinkd.wire import make_registry
from tests.lab.saturated import PDU_SIZE, usrp
from tests.laws import one_in

pytestmark = pytest.mark.slow
SETTLE_S = 4.0
"""Time until all robots know the schedule, and each other's periods."""
RADIOS = {
    "soon": {"block_s": 1e-4},
    "blocks": {},
    "usrp": {"rate_hz": 2e6, "fit": usrp},
    "turns_slowly": {"turnaround_s": 0.01},
}
LOADS = {
    "odometry": [("latency", 30, 724)],
    "small_and_large": [("latency", 20, 990), ("bulk", 1, 65_536)],
    "three": [("latency", 20, 700), ("default", 7, 3000), ("bulk", 0.5, 40_000)],
    "late_joiner": [("urgent", 5, 64), ("default", 15, 1500)],
}


def set_up(policy, robots, n_topics=1, qos=(), arrivals=None, listen=lambda *_: None, seed=1, *,
           rate_hz=5e6, block_s=1e-3, turnaround_s=1e-4, fit=lambda traits: traits, snr_db=25,
           has_numbers=False):  # fmt: skip
    """Simulation and setting of `robots` that send; a single sender gets a listener."""
    rng, nodes = Random(seed), range(1, max(2, robots) + 1)
    modem, air = (
        ModemParams(rate_hz=rate_hz),
        AirParams(rate_hz=rate_hz, block_s=block_s, snr_db=snr_db),
    )
    airtimes = Airtimes(modem, PDU_SIZE)
    registry = make_registry([(f"t{i}", "std_msgs/msg/ByteMultiArray") for i in range(n_topics)])
    links = {
        node: Link(LinkParams(pdu_size=PDU_SIZE), QueueParams(), ReassemblyParams(), registry,
                   node, Random(100 * seed + node), has_numbers=has_numbers)
        for node in nodes
    }  # fmt: skip
    for link in links.values():
        link.set_policies(policies_of(qos))
    radios = {
        node: RadioParams(full_duplex=policy == "none", turnaround_s=turnaround_s,
                          clock_ppm=rng.uniform(-10, 10))
        for node in nodes
    }  # fmt: skip
    sim = Simulation(
        air, World(air, {}), radios, links, modem, airtimes,
        AccessParams(policy=policy, nodes=[] if policy == "none" else list(nodes)),
        arrivals or {}, seed=seed, fit=fit, listen=listen,
    )  # fmt: skip
    one, sharing = sim.stations[1], robots if policy == "none" else len(nodes)
    return sim, Setting(
        airtimes, PDU_SIZE, modem.mcs, one.traits.longest_burst_s[modem.mcs], ClassesParams(),
        sharing, one.settled, one.traits, host_s=0.0, has_numbers=has_numbers,
    )  # fmt: skip


def policies_of(qos):
    """Policies by topic id; nothing expires."""
    return {i: TopicPolicy(qos=each, lifespan_s=float("inf")) for i, each in enumerate(qos)}


def plan_of(setting, loads):
    """The plan for topics of (class, rate in Hz, bytes)."""
    asked = [Load(i, f"t{i}", rate, size, size) for i, (_, rate, size) in enumerate(loads)]
    return make_plan(asked, policies_of([qos for qos, _, _ in loads]), setting)


def trial(policy, robots, loads, seed, seconds=10.0, **radio):
    """The plan, and the ages in s of the messages that arrived, by topic."""
    until_s, ages = SETTLE_S + seconds, [[] for _ in loads]

    def arrivals(node):
        chance, found = np.random.default_rng([seed, node]), []
        for topic_id, (_, per_s, size) in enumerate(loads):
            # The phases drift relative to each other.
            period_s = (1 + 1e-3 * chance.uniform(-1, 1)) / per_s
            times = np.arange(chance.uniform(0, period_s), until_s, period_s)
            found += [Arrival(float(at), topic_id, bytes(size)) for at in times]
        return sorted(found)

    def listen(_, message, now):
        if now > SETTLE_S and message.origin_at is not None:
            ages[message.topic_id].append(now - message.origin_at)

    sim, setting = set_up(
        policy, robots, len(loads), [qos for qos, _, _ in loads],
        {node: arrivals(node) for node in range(1, robots + 1)}, listen, seed, **radio,
    )  # fmt: skip
    sim.run(until_s)
    return plan_of(setting, loads), ages


CASES = [
    (policy, robots, radio)
    for policy, team, radios in (
        ("none", (1, 2), ("blocks", "usrp")),
        ("tdma", (1, 2, 3), ("blocks", "usrp", "turns_slowly")),
        ("minislot", (1, 2, 3), ("soon",)),
        ("grant", (1, 2, 3), ("blocks", "usrp", "turns_slowly")),
        ("auction", (1, 2, 3), ("soon",)),
    )
    for robots in team
    for radio in radios
]


@pytest.mark.parametrize(("policy", "robots", "radio"), one_in(9, CASES))
def test_nothing_comes_later_than_the_plan_says(policy, robots, radio):
    seed = CASES.index((policy, robots, radio))
    load = list(LOADS.values())[seed % len(LOADS)]
    plan, ages = trial(policy, robots, load, seed, **RADIOS[radio])
    for topic, came in zip(plan.topics, ages, strict=True):
        if plan.is_feasible:
            assert np.quantile(came, 0.99) <= topic.worst_s, topic


@pytest.mark.long
@pytest.mark.parametrize(
    ("policy", "robots", "radio"),
    # If one robot is silent, the others get its airtime. With requests, the worst case is that
    # everything expected comes at the worst time, which hardly happens.
    [c for c in CASES if c[0] == "none" or (c[1] > 1 and c[0] != "grant")],
)
def test_what_fills_the_air_comes_not_much_sooner_than_the_plan_says(policy, robots, radio):
    """Large messages, with a load just below the limit."""

    def loads(per_s):
        return [("latency", 5, 500), ("bulk", per_s, 20_000)]

    _, setting = set_up(policy, robots, **RADIOS[radio])
    rates = (0.1 * n for n in range(400, 1, -1))
    per_s = 0.9 * next(each for each in rates if plan_of(setting, loads(each)).is_feasible)
    plan, ages = trial(policy, robots, loads(per_s), 7 + robots, **RADIOS[radio])
    assert plan.air > 0.75
    bulk, p99_s = plan.topics[1], np.quantile(ages[1], 0.99)
    assert bulk.worst_s / 3 < p99_s <= bulk.worst_s


@pytest.mark.long
def test_a_two_megabyte_point_cloud_beside_a_scan():
    """At 20 dB, one cloud in 12 s; all arrive, and neither topic later than the plan says."""
    loads = [("latency", 50, 1024), ("bulk", 1 / 12, 2_000_000)]
    plan, ages = trial("none", 1, loads, 21, seconds=36.0, snr_db=20, has_numbers=True)
    scan, cloud = plan.topics
    assert plan.is_feasible
    assert cloud.pdus > 2200, "with parity"
    assert len(ages[0]) == pytest.approx(50 * 36, abs=2)
    assert len(ages[1]) >= 2
    assert max(ages[0]) <= scan.worst_s
    assert max(ages[1]) <= cloud.worst_s
