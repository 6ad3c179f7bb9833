"""Whether an urgent message ever waits longer than the plan says, in a team with every trouble.

All robots have more to send than the air carries, of less urgent classes. They move, some leave and
come back, and one PDU in twenty is lost. One robot sends the urgent messages, a single one at a
time.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations
from math import inf
from random import Random
from typing import NamedTuple

from backends import Outage, Track
from benchmarks.team.crowd import Class
from benchmarks.team.teams import CDR, RATE_HZ, Flow, Heard, Policy, Strain, Team
from benchmarks.worlds.flight import Flight
from sdrlinkd.config import ModemParams
from sdrlinkd.link import Burst, Qos
from sdrlinkd.plan import access_bounds
from sdrlinkd.wire import BROADCAST

MODEM = ModemParams(rate_hz=RATE_HZ, mcs=3, block_s=1e-4, max_burst_s=0.01)
PDU_SIZE, FILLING = 2000, 1850
"""Few large PDUs, so that an hour takes minutes. Each message fills one."""
PROBE = 64
OFFERED_MBPS = 9.0
"""What all robots want to send together, on an air that carries 6 Mbit/s."""
LOST = 0.05
RADIUS_M, STEP_S = 100.0, 10.0
"""Robots move on straight lines within this circle, to another place every so often: at 25 to 60 m
of distance they have 24 to 32 dB, and 14 dB at least."""
KEEP_S = 5e-3
"""Time for which the SNR of a pair counts."""
STAYS_S, AWAY_S = 30.0, (1.0, 5.0, 20.0)
"""How long robots are here on average, and away."""
LISTENS_S = 0.03
"""Time for which a radio that is on again only listens, to notice what is on the air already."""
ALMOST_S = 2e-4
"""When a message comes, its robot looks at the end of the block."""
LOOKS_S = 0.02
"""How often to look whether something is announced, beside when bursts and messages begin."""
REST_S = 1.5
"""Time after the last message that counts."""
MIXES: Sequence[Sequence[Class]] = (
    ("latency",), ("bulk",), ("latency", "bulk"), ("default", "bulk"), ("default",),
    ("latency", "default", "bulk"),
)  # fmt: skip


class Told(NamedTuple):
    """What became of the urgent messages; times in s."""

    bound_s: float
    n: int
    broken: int
    """Messages that waited longer, though nothing was announced."""
    longest_s: float
    """The longest wait, where nothing was announced."""
    in_outages: int
    """Messages that waited while their robot lacked what tells its turns."""
    lost: int
    """Messages that never came to another robot that was there."""
    repeated_s: float
    """The longest time from when a message left until it came, by a repeat."""


@dataclass
class _Seen:
    """What the robot with the urgent messages did."""

    node: int
    lacked_at: list[float] = field(default_factory=list)
    left_at: dict[int, float] = field(default_factory=dict)
    """When each message had left, by number."""
    bursts: list[tuple[float, float]] = field(default_factory=list)
    """Its bursts with something urgent, as (begin, end)."""

    def left(self, flight: Flight, burst: Burst) -> None:
        if flight.sender != self.node or Qos.URGENT not in burst.classes:
            return
        self.bursts.append((flight.start_s, flight.end_s))
        for carried, (_, end_s) in zip(burst.carried, flight.shape.pdus, strict=True):
            for message in carried:
                if message.qos is Qos.URGENT:
                    number = int.from_bytes(message.payload[len(CDR) :][:4], "little")
                    self.left_at[number] = flight.start_s + end_s

    def lacked(self, since: float, until: float) -> bool:
        return bisect_left(self.lacked_at, since - ALMOST_S) != bisect_right(self.lacked_at, until)

    def head_at(self, at: float, left_at: float) -> float:
        """When a message that came at `at` was the next one: repeats are of its class, too."""
        before = [end for begin, end in self.bursts if at < begin and end < left_at]
        return max(before, default=at)


def strain(policy: Policy, n: int, seed: int, duration_s: float, *, is_calm: bool = False) -> Told:
    """Let a team live through all that; with `is_calm`, nobody moves, and none is lost."""
    rng, ids = Random(seed), range(1, n + 1)
    seen, mix = _Seen(ids[seed % n]), MIXES[seed % len(MIXES)]
    tracks, off = {}, {}
    if not is_calm:
        tracks = {node: _track(rng, duration_s) for node in ids}
        off = {node: _away(rng, duration_s) for node in ids if node != seen.node}
    bound_s = _bound_s(policy, n)
    listener = ids[1] if seen.node == ids[0] else ids[0]
    count = max(1, int(duration_s / (2 * bound_s)))
    flows = [
        Flow(
            "urgent", seen.node, BROADCAST, PROBE, bound_s, count, 0.0, counted_at=listener,
            qos="urgent", is_random=True, least_s=bound_s,
        )
    ]  # fmt: skip
    period_s = n * len(mix) * 8 * FILLING / (1e6 * OFFERED_MBPS)
    flows += [
        Flow(qos, node, BROADCAST, FILLING, period_s, int(1.1 * duration_s / period_s), 0.0,
             qos=qos, is_random=True)
        for qos in mix
        for node in ids
    ]  # fmt: skip

    def look() -> None:
        if access.lacks:
            seen.lacked_at.append(simulation.now)

    def watch(flight: Flight, burst: Burst) -> None:
        look()
        seen.left(flight, burst)

    how = Strain(tracks, off, 0.0 if is_calm else LOST, KEEP_S, relays=False, watch=watch)
    team = Team(ids, list(combinations(ids, 2)), flows, seed, policy, PDU_SIZE, modem=MODEM,
                strain=how)  # fmt: skip
    simulation = team.simulation
    access = simulation.stations[seen.node].settled.access
    for at in (*team.heard[0].sent_at, *(LOOKS_S * i for i in range(int(duration_s / LOOKS_S)))):
        simulation.call(at, look)
    for node, times in off.items():
        for begin_s, end_s in times:
            simulation.call(begin_s, partial(simulation.silence, node, end_s + LISTENS_S))
    simulation.run(duration_s)
    return _judged(team.heard[0], seen, bound_s, duration_s, off.get(listener, []))


def _judged(
    heard: Heard, seen: _Seen, bound_s: float, duration_s: float, away: Sequence[Outage]
) -> Told:
    waits_s = list[float]()
    n = in_outages = lost = 0
    repeated_s = 0.0
    for number, at in enumerate(heard.sent_at):
        if at > duration_s - REST_S:
            break
        n += 1
        left_at = seen.left_at.get(number, inf)
        if seen.lacked(at, min(left_at, at + REST_S)):
            in_outages += 1
        else:
            waits_s.append(left_at - seen.head_at(at, left_at))
        came_at = heard.at.get(number, inf)
        if came_at < inf:
            repeated_s = max(repeated_s, came_at - left_at)
        elif not any(begin - REST_S < at < end + REST_S for begin, end in away):
            lost += 1
    broken = sum(each > bound_s for each in waits_s)
    return Told(bound_s, n, broken, max(waits_s, default=0.0), in_outages, lost, repeated_s)


def _bound_s(policy: Policy, n: int) -> float:
    """What the plan says of class urgent, for the radios of this team."""
    flow = Flow("urgent", 1, BROADCAST, PROBE, 1.0, 0, 0.0)
    team = Team(range(1, n + 1), [], [flow], 0, policy, PDU_SIZE, modem=MODEM)
    station = team.simulation.stations[1]
    traits = station.traits
    longest_s, one_s = traits.longest_burst_s[MODEM.mcs], traits.pdu_burst_s[MODEM.mcs]
    urgent = access_bounds(station.settled, traits, n, longest_s, one_s)[Qos.URGENT]
    return urgent.first_s


def _track(rng: Random, duration_s: float) -> Track:
    points = []
    for number in range(int(duration_s / STEP_S) + 2):
        away_m, angle = RADIUS_M * math.sqrt(rng.random()), rng.uniform(0, math.tau)
        points.append((number * STEP_S, away_m * math.cos(angle), away_m * math.sin(angle)))
    return Track(points)


def _away(rng: Random, duration_s: float) -> list[Outage]:
    """When a robot is away."""
    at, times = 0.0, list[Outage]()
    while (at := at + rng.expovariate(1 / STAYS_S)) < duration_s:
        end = at + rng.choice(AWAY_S)
        times.append(Outage(at, end))
        at = end
    return times
