"""Share of the air that CLOCKs and RECEIPTs take, with five robots."""

from collections.abc import Iterable, Iterator
from random import Random
from typing import NamedTuple

import numpy as np

from backends import AirParams, RadioParams, World
from benchmarks.worlds.arrivals import Arrival
from benchmarks.worlds.bursts import Simulation
from sdrlinkd.config import ModemParams
from sdrlinkd.link import (
    AccessParams,
    ClockParams,
    Link,
    LinkParams,
    Overrides,
    QueueParams,
    ReassemblyParams,
)
from sdrlinkd.modem import Airtimes
from sdrlinkd.wire import make_registry

ROBOTS = 5
PDU_SIZE = 1024
REGISTRY = make_registry([("odom", "nav_msgs/Odometry"), ("cmd", "geometry_msgs/Twist")])
ODOM, CMD = range(2)
SETTLING_S = 10.0
"""Time until every robot knows the number of robots."""
CMD_HZ = 2.0
"""Rate of commands, each with a receipt from every robot."""
ODOM_SIZE, CMD_SIZE = 700, 52


class Case(NamedTuple):
    """A channel; `odom_hz`: rate of each robot's other messages."""

    rate_hz: float
    mcs: int
    odom_hz: float


class Share(NamedTuple):
    """Airtime shares in percent; `period_s`: between CLOCKs in PDUs of their own, on average."""

    control_pct: float
    all_pct: float
    period_s: float
    verdicts: dict[str, int]


FAST = Case(5e6, 3, 4.0)
SLOW = Case(1e6, 1, 0.5)


def measure(case: Case, seed: int, seconds: float) -> Share:
    """Measure with mini-slots, half duplex, as daemons are configured."""
    air = AirParams(rate_hz=case.rate_hz, snr_db=25.0, block_s=0.001)
    modem = ModemParams(rate_hz=case.rate_hz, mcs=case.mcs, block_s=air.block_s)
    robots = range(1, ROBOTS + 1)
    radios = {robot: RadioParams(turnaround_s=1e-4) for robot in robots}
    links = {
        robot: Link(
            LinkParams(pdu_size=PDU_SIZE, beacon_s=1.0),
            QueueParams(),
            ReassemblyParams(),
            REGISTRY,
            robot,
            Random(100 * seed + robot),
            clock=ClockParams(),
        )
        for robot in robots
    }
    arrivals = {robot: list(_traffic(case, seed, robot, seconds)) for robot in robots}
    simulation = Simulation(
        air, World(air, {}), radios, links, modem, Airtimes(modem, PDU_SIZE),
        AccessParams(policy="minislot", nodes=list(robots), force=True), arrivals, seed=seed,
    )  # fmt: skip
    simulation.run(SETTLING_S)
    control_s, all_s = _sent_s(links.values(), SETTLING_S)
    simulation.run(seconds + SETTLING_S)
    until_s = seconds + SETTLING_S
    control_then_s, all_then_s = _sent_s(links.values(), until_s)
    verdicts: dict[str, int] = {}
    for link in links.values():
        for verdict in link.take_verdicts():
            verdicts[verdict.fate] = verdicts.get(verdict.fate, 0) + 1
    period_s = float(np.mean([link.report(until_s).control_period_s for link in links.values()]))
    return Share(
        100 * (control_then_s - control_s) / seconds,
        100 * (all_then_s - all_s) / seconds,
        period_s,
        verdicts,
    )


def _sent_s(links: Iterable[Link], now: float) -> tuple[float, float]:
    """Airtime up to `now`, in s: (PDUs with records only, all bursts)."""
    reports = [link.report(now) for link in links]
    return sum(each.control_airtime_s for each in reports), sum(each.airtime_s for each in reports)


def _traffic(case: Case, seed: int, robot: int, seconds: float) -> Iterator[Arrival]:
    rng = np.random.default_rng([seed, robot])
    times = [
        (float(at), topic)
        for topic, hz in ((ODOM, case.odom_hz), (CMD, CMD_HZ))
        for at in rng.uniform(0, 1 / hz) + np.arange(int(seconds * hz)) / hz
    ]
    for number, (at, topic) in enumerate(sorted(times)):
        size = ODOM_SIZE if topic == ODOM else CMD_SIZE
        receipt = f"{robot}.{number}" if topic == CMD else ""
        yield Arrival(at, topic, b"\0\1\0\0" + rng.bytes(size - 4), Overrides(receipt=receipt))
