"""Eight robots that drive about: what arrives while there is a path, over one or more hops."""

import math
from random import Random
from typing import NamedTuple

import numpy as np

from backends import AirParams, Track, World
from benchmarks.team.teams import RATE_HZ, Flow, Policy, Strain, Team
from sdrlinkd.config import ModemParams

N = 8
BASE = 1
SIDE_M, SPEED_MPS = 300.0, (1.0, 4.0)
"""The robots drive from place to place in a square, with the base at its edge."""
AIR = AirParams(
    rate_hz=RATE_HZ, block_s=2e-4, snr_db_at_1m=70.0, path_loss_exponent=3.0
)  # fmt: skip
MODEM = ModemParams(rate_hz=RATE_HZ, mcs=3, max_burst_s=0.02, block_s=AIR.block_s)
HEARD_DB = 8.0
"""SNR from which a link counts; it loses next to nothing."""
BEFORE_S, AFTER_S = 2.0, 0.5
"""A path must have been there for so long before a message is sent, and stay for so long."""
STEP_S = 0.1
BEGIN_S, REST_S = 8.0, 2.0
KEPT_S = 0.05
"""Time for which the SNR of a pair is kept: at 8 m/s, they come 0.4 m nearer."""

CLASSES = ("urgent", "latency", "default")


class Drove(NamedTuple):
    """What became of the messages of each class that had a path all the time."""

    sent: dict[str, int]
    lost: dict[str, int]
    without_path: dict[str, int]
    """Messages that are not counted, as there was none."""
    hops: float
    """Mean number of hops of the shortest path."""
    control_share: float

    def mdr(self, qos: str) -> float:
        """Messages that came over messages sent."""
        return 1 - self.lost[qos] / max(1, self.sent[qos])


def drive(policy: Policy, seed: int, duration_s: float) -> Drove:
    """Let everybody report to the base, which sends commands to everybody, for `duration_s`."""
    rng, end_s = Random(seed), BEGIN_S + duration_s
    tracks = {node: _track(rng, end_s + REST_S) for node in range(2, N + 1)}
    tracks[BASE] = Track([(0.0, 0.0, SIDE_M / 2)])
    flows = []
    for node in range(2, N + 1):
        at_s = BEGIN_S + rng.uniform(0, 0.1)
        flows += [
            _flow(f"stop{node}", BASE, node, 64, 0.5, at_s, duration_s, "urgent", is_random=True),
            _flow("odom", node, BASE, 200, 0.1, at_s, duration_s, "latency"),
            _flow("status", node, BASE, 1000, 1.0, at_s, duration_s, "default"),
        ]
    team = Team(
        range(1, N + 1), None, flows, seed, policy, modem=MODEM, air=AIR,
        strain=Strain(tracks=tracks, keep_s=KEPT_S),
    )  # fmt: skip
    team.simulation.run(end_s + REST_S)
    paths = _Paths(World(AIR, tracks), end_s + REST_S)
    return _counted(team, paths, end_s)


def _flow(
    name: str, src: int, dst: int, size: int, period_s: float, begin_s: float, duration_s: float,
    qos: str, *, is_random: bool = False,
) -> Flow:  # fmt: skip
    n = round(duration_s / period_s)
    return Flow(name, src, dst, size, period_s, n, begin_s, qos=qos, is_random=is_random)  # type: ignore[arg-type]


def _track(rng: Random, end_s: float) -> Track:
    """From one random place to another, each leg at a random speed."""
    at_s, x, y = 0.0, rng.uniform(0, SIDE_M), rng.uniform(0, SIDE_M)
    waypoints = [(at_s, x, y)]
    while at_s < end_s:
        to_x, to_y = rng.uniform(0, SIDE_M), rng.uniform(0, SIDE_M)
        at_s += max(0.1, math.hypot(to_x - x, to_y - y) / rng.uniform(*SPEED_MPS))
        x, y = to_x, to_y
        waypoints.append((at_s, x, y))
    return Track(waypoints)


class _Paths:
    """Whether there was a path between two robots, and how long it was."""

    def __init__(self, world: World, end_s: float) -> None:
        self._hops = [self._distances(world, i * STEP_S) for i in range(math.ceil(end_s / STEP_S))]

    def hops(self, src: int, dst: int, at_s: float) -> float:
        """Most hops of the shortest path around a time; infinity: there was none at some time."""
        first = max(0, math.floor((at_s - BEFORE_S) / STEP_S))
        last = min(len(self._hops) - 1, math.ceil((at_s + AFTER_S) / STEP_S))
        return max(float(each[src - 1, dst - 1]) for each in self._hops[first : last + 1])

    @staticmethod
    def _distances(world: World, at_s: float) -> np.ndarray:
        hops = np.full((N, N), np.inf)
        for one in range(N):
            hops[one, one] = 0
            for other in range(one):
                hop = world.hop(one + 1, other + 1, at_s)
                if hop is not None and hop.snr_db >= HEARD_DB:
                    hops[one, other] = hops[other, one] = 1
        for via in range(N):
            hops = np.minimum(hops, hops[:, via, None] + hops[via])
        return hops


def _counted(team: Team, paths: _Paths, end_s: float) -> Drove:
    sent, lost, without = (dict.fromkeys(CLASSES, 0) for _ in range(3))
    lengths: list[float] = []
    for heard in team.heard:
        flow = heard.flow
        for number, at_s in enumerate(heard.sent_at):
            if at_s > end_s:
                break
            hops = paths.hops(flow.src, flow.dst, at_s)
            if hops == math.inf:
                without[flow.qos] += 1
                continue
            lengths.append(hops)
            sent[flow.qos] += 1
            lost[flow.qos] += number not in heard.at
    mean = sum(lengths) / max(1, len(lengths))
    return Drove(sent, lost, without, mean, team.control_share())
