"""Two robots with radios like a USRP: odometry and images both ways.

That is more than turns by listening can carry. It runs in virtual time; for real time see `python
-m benchmarks.radio.team`.
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
    Link,
    LinkParams,
    QueueParams,
    ReassemblyParams,
    Told,
    TopicPolicy,
)
from sdrlinkd.modem import Airtimes
from sdrlinkd.wire import make_registry
from tests.lab.saturated import PDU_SIZE, usrp
from tests.laws import one_in

pytestmark = pytest.mark.slow
ROBOTS = (1, 2)
TOPICS = (("odom", "nav_msgs/msg/Odometry"), ("image", "sensor_msgs/msg/CompressedImage"))
ODOM, IMAGE = 0, 1
POLICIES = {ODOM: TopicPolicy(qos="latency"), IMAGE: TopicPolicy(qos="bulk")}
BEGIN_S, SECONDS, DRAIN_S = 2.0, 20, 5.0
FILE = Told("robot.toml", ())


def team(policy, rate_hz, mcs, seed=1):
    """The simulation after 20 s of 30 Hz odometry of 724 B and one image of 64 KB per second."""
    modem = ModemParams(rate_hz=rate_hz, mcs=mcs)
    air = AirParams(rate_hz=rate_hz, snr_db=25.0)
    links = {
        robot: Link(LinkParams(pdu_size=PDU_SIZE), QueueParams(), ReassemblyParams(),
                    make_registry(TOPICS), robot, Random(100 * seed + robot))
        for robot in ROBOTS
    }  # fmt: skip
    for link in links.values():
        link.set_policies(POLICIES)

    def arrivals(robot):
        rng, found = np.random.default_rng([seed, robot]), []
        for topic_id, per_s, size in ((ODOM, 30, 724), (IMAGE, 1, 65_536)):
            first = BEGIN_S + rng.uniform(0, 1 / per_s)
            found += [Arrival(first + i / per_s, topic_id, bytes(size))
                      for i in range(per_s * SECONDS)]  # fmt: skip
        return sorted(found)

    sim = Simulation(
        air, World(air, {}), {robot: RadioParams(clock_ppm=3.0 * robot) for robot in ROBOTS},
        links, modem, Airtimes(modem, PDU_SIZE),
        AccessParams(policy=policy, nodes=list(ROBOTS), force=policy != "auto"),
        {robot: arrivals(robot) for robot in ROBOTS}, seed=seed, fit=usrp,
    )  # fmt: skip
    sim.run(BEGIN_S + SECONDS + DRAIN_S)
    assert [line for each in sim.stations.values() for line in each.link.audit()] == []
    return sim


@pytest.mark.parametrize(("rate_hz", "mcs"), one_in(2, [(2e6, 3), (5e6, 1)]))
def test_auto_carries_all_of_it(rate_hz, mcs):
    sim = team("auto", rate_hz, mcs)
    for sender, receiver in ((1, 2), (2, 1)):
        assert sim.stations[sender].settled.policy == "tdma"
        for topic_id, count in ((ODOM, 30 * SECONDS), (IMAGE, SECONDS)):
            assert sim.pairs[sender, receiver, topic_id].received == count
        odometry_s = sim.pairs[sender, receiver, ODOM].ages_s
        assert np.median(odometry_s) < 0.036
        assert np.quantile(odometry_s, 0.99) < 0.06


def test_minislots_do_not_and_why_says_so():
    sim = team("minislot", 2e6, 3)
    pair = sim.pairs[1, 2, ODOM]
    assert pair.received < 0.7 * 30 * SECONDS
    assert sim.pairs[1, 2, IMAGE].received == 0
    # Arriving messages are no older than their class allows, plus the time on the air.
    assert max(pair.ages_s) < 2.1
    told = sim.stations[1].link.why(ODOM, FILE, sim.now)
    assert told[0].endswith("lifespan 2 s from its class (robot.toml)")
    assert any("older than 2 s, the lifespan of class latency" in line for line in told)
    assert told[-1].startswith("the channel was idle 8")
    assert (
        "minislot waits up to 70.7 ms after every burst on this radio and leaves 5 % of the "
        "airtime usable; tdma would carry 19 times as much"
    ) in told[-1]
