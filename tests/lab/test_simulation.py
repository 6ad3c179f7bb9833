"""The simulation in bursts compared with that in samples, and long runs with many robots."""

import asyncio
from collections import Counter
from itertools import pairwise
from random import Random

import numpy as np
import pytest

import phy
from backends import AirParams, LinkOverride, RadioParams, World
from benchmarks.worlds import arrivals as messages
from benchmarks.worlds import samples
from benchmarks.worlds.bursts import Simulation
from sdrlinkd.config import ModemParams
from sdrlinkd.link import AccessParams, Link, LinkParams, QueueParams, ReassemblyParams
from sdrlinkd.modem import Airtimes
from sdrlinkd.wire import make_registry
from tests.laws import one_in

RATE = 1e6
MCS = 3
TURNAROUND_S = 1e-4
INFINITE = float("inf")


def radios(n, seed):
    """Half-duplex radios with crystal errors."""
    rng = Random(seed)
    return {
        node: RadioParams(
            full_duplex=False, turnaround_s=TURNAROUND_S, clock_ppm=rng.uniform(-10, 10)
        )
        for node in range(1, n + 1)
    }


def poisson(node, per_s, size, until_s, seed):
    """Messages of `size` bytes at random times."""
    rng = np.random.default_rng([seed, node])
    return list(messages.poisson(rng, samples.DATA, per_s, size, until_s))


def simulation(
    policy, arrivals, *, air, pdu_size, seed, links=(), mcs=MCS, beacons_s=None, keep_s=INFINITE,
    **more,
):  # fmt: skip
    """Robots 1 to n, as benchmarks.worlds.samples makes them; `beacons_s` by robot, default 1."""
    ids = list(arrivals)
    modem = ModemParams(rate_hz=air.rate_hz, mcs=mcs)
    made = {
        node: Link(
            LinkParams(pdu_size=pdu_size, beacon_s=(beacons_s or {}).get(node, 1.0)),
            QueueParams(), ReassemblyParams(), make_registry(samples.TOPICS), node,
            Random(100 * seed + node),
        )
        for node in ids
    }  # fmt: skip
    return Simulation(
        air, World(air, {}, links), radios(len(ids), seed), made, modem, Airtimes(modem, pdu_size),
        AccessParams(policy=policy, nodes=[] if policy == "none" else ids, force=True),
        arrivals,
        seed=seed, keep_s=keep_s, **more,
    )  # fmt: skip


def got(sim):
    """By (sender, receiver): messages received, mean age in s."""
    return {
        key[:2]: (pair.received, pair.age_sum_s / pair.received) for key, pair in sim.pairs.items()
    }


def delivered(sim):
    """The share of all messages that all others received."""
    sent = sum(sum(each.sent.values()) for each in sim.stations.values())
    return sum(n for n, _ in got(sim).values()) / sent / (len(sim.stations) - 1)


def audit(sim):
    return [line for each in sim.stations.values() for line in each.link.audit()]


def hears_only_neighbors(n):
    """Links of a chain, in which each robot only hears its neighbors."""
    pairs = [(a, b) for a in range(1, n + 1) for b in range(a + 2, n + 1)]
    return [LinkOverride(sender=a, receiver=b, snr_db=-300) for a, b in pairs]


def two_senders(policy, n_nodes=2, seconds=1.0, seed=3, load=0.4):
    """(by samples, by bursts): messages received and mean age in s of each pair."""
    # A message with its STAMP, and a WANT.
    pdu_size, until_s = 1056 + 16 * (policy == "auction"), seconds + 0.3
    airtime_s = phy.layout(phy.OFDM_64_16, MCS, 1, pdu_size).n_samples / RATE
    air = AirParams(rate_hz=RATE, block_s=2e-4, snr_db=25.0)
    arrivals = {
        node: poisson(node, load / airtime_s, 1024, seconds, seed) if node <= 2 else []
        for node in range(1, n_nodes + 1)
    }
    nodes = list(arrivals)
    access = AccessParams(policy=policy, nodes=nodes if policy != "none" else [], force=True)
    modem = ModemParams(rate_hz=RATE, mcs=MCS)
    stations = asyncio.run(
        samples.run(air, radios(n_nodes, seed), access, modem, pdu_size, arrivals, until_s, seed)
    )
    by_samples = {}
    for receiver, station in zip(nodes, stations, strict=True):
        for sender in nodes[:2]:
            ages = [each.age_s for each in station.got if each.src == sender]
            if ages:
                by_samples[sender, receiver] = len(ages), np.mean(ages)
    sim = simulation(policy, arrivals, air=air, pdu_size=pdu_size, seed=seed)
    sim.run(until_s)
    assert audit(sim) == []
    return by_samples, got(sim), {node: len(arrivals[node]) for node in nodes}


@pytest.mark.slow
def test_without_access_it_loses_what_samples_lose():
    """Two simultaneous senders are deaf, and collide at a third robot."""
    by_samples, by_bursts, sent = two_senders("none", n_nodes=3)
    assert by_samples.keys() == by_bursts.keys() == {(1, 2), (2, 1), (1, 3), (2, 3)}
    for pair, (n, age_s) in by_samples.items():
        assert n / sent[pair[0]] < 0.6
        assert by_bursts[pair][0] / sent[pair[0]] == pytest.approx(n / sent[pair[0]], abs=0.05)
        assert by_bursts[pair][1] == pytest.approx(age_s, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("policy", "load"), one_in(2, [("minislot", 0.4), ("auction", 0.3), ("tdma", 0.4)])
)
def test_with_access_it_delivers_as_samples_do(policy, load):
    by_samples, by_bursts, sent = two_senders(policy, load=load)
    assert by_samples.keys() == by_bursts.keys() == {(1, 2), (2, 1)}
    for pair, (n, age_s) in by_samples.items():
        assert n == by_bursts[pair][0] == sent[pair[0]]
        assert by_bursts[pair][1] == pytest.approx(age_s, rel=0.25)


class Overlaps:
    """Watches bursts, and counts those that begin before all others are over."""

    def __init__(self):
        self.flights = []

    def __call__(self, flight, _burst):
        self.flights.append((flight.start_s, flight.end_s, flight.sender))

    @property
    def found(self):
        return [(one, other) for one, other in pairwise(sorted(self.flights)) if other[0] < one[1]]


def small_messages(n, per_s, until_s, seed):
    return {node: poisson(node, per_s, 40, until_s, seed) for node in range(1, n + 1)}


@pytest.mark.long
def test_24_robots_with_tdma_for_ten_minutes():
    """The first robot announces the schedule.

    The others hardly announce themselves, which saves half of the run time.
    """
    n, seconds, seed = 24, 600.0, 7
    overlaps = Overlaps()
    sim = simulation(
        "tdma", small_messages(n, 0.12, seconds, seed), air=AirParams(snr_db=25.0), pdu_size=256,
        seed=seed, mcs=1, beacons_s=dict.fromkeys(range(2, n + 1), 30.0), watch=overlaps,
    )  # fmt: skip
    sim.run(seconds + 1)
    assert delivered(sim) == 1
    assert len(got(sim)) == n * (n - 1)
    assert min(sum(each.sent.values()) for each in sim.stations.values()) > 40
    assert audit(sim) == []
    assert overlaps.found == []
    round_s = sim.stations[1].settled.access.round_s
    assert max(age_s for _, age_s in got(sim).values()) < round_s


@pytest.mark.long
def test_12_robots_with_minislots_for_two_minutes():
    n, seconds, seed = 12, 120.0, 8
    overlaps = Overlaps()
    sim = simulation(
        "minislot", small_messages(n, 1.0, seconds, seed), air=AirParams(snr_db=25.0),
        pdu_size=256, seed=seed, mcs=1, beacons_s=dict.fromkeys(range(1, n + 1), 5.0),
        watch=overlaps,
    )  # fmt: skip
    sim.run(seconds + 1)
    assert delivered(sim) == 1
    assert len(got(sim)) == n * (n - 1)
    assert audit(sim) == []
    assert overlaps.found == []
    assert max(age_s for _, age_s in got(sim).values()) < 2 * sim.stations[1].settled.access.round_s


@pytest.mark.slow
@pytest.mark.parametrize(("policy", "least", "most"), [("minislot", 0.3, 0.9), ("tdma", 1, 1)])
def test_those_who_do_not_hear_each_other_need_a_schedule(policy, least, most):
    """In a chain of three, the outer two collide in the middle without a schedule."""
    seed, seconds = 9, 15.0
    arrivals = {
        1: poisson(1, 25.0, 200, seconds, seed),
        2: [],
        3: poisson(3, 25.0, 200, seconds, seed),
    }
    sim = simulation(
        policy, arrivals, air=AirParams(rate_hz=RATE, snr_db=25.0), pdu_size=256, seed=seed, mcs=1,
        links=hears_only_neighbors(3),
    )  # fmt: skip
    sim.run(seconds + 1)
    pairs = got(sim)
    assert pairs.keys() == {(1, 2), (3, 2)}
    share = sum(n for n, _ in pairs.values()) / sum(map(len, arrivals.values()))
    assert least <= share <= most


@pytest.mark.slow
def test_a_chain_keeps_one_schedule():
    seed = 10
    sim = simulation(
        "tdma", small_messages(5, 1.0, 20.0, seed), air=AirParams(snr_db=25.0), pdu_size=256,
        seed=seed, links=hears_only_neighbors(5),
    )  # fmt: skip
    sim.run(20.0)
    told = {node: each.settled.access.frame(20.0)[:2] for node, each in sim.stations.items()}
    assert told == {1: (1, 0), 2: (1, 1), 3: (1, 2), 4: (1, 3), 5: (1, 4)}


@pytest.mark.slow
@pytest.mark.parametrize("policy", one_in(2, ["none", "auction", "csma", "minislot", "tdma"]))
def test_looking_only_when_it_may_matter_loses_nothing(policy, monkeypatch):
    """Compared with a query after every block, as in a modem."""
    ends = []
    for how in ("now and then", "every block"):
        if how == "every block":
            monkeypatch.setattr("benchmarks.worlds.bursts.next_chance", lambda *given: given[-1])
        arrivals = small_messages(5, 15.0, 4.0, 11)
        sim = simulation(policy, arrivals, air=AirParams(snr_db=25.0), pdu_size=128, seed=11)
        sim.run(5.0)
        ends.append((got(sim), {node: each.bursts for node, each in sim.stations.items()}))
    assert ends[0] == ends[1]


def outcome(seed):
    arrivals = small_messages(4, 20.0, 3.0, 1)
    sim = simulation("csma", arrivals, air=AirParams(snr_db=5.0), pdu_size=128, seed=seed, mcs=1)
    sim.run(4.0)
    assert audit(sim) == []
    counters = Counter()
    for each in sim.stations.values():
        counters.update(each.link.report(sim.now).rx.pdus_dropped)
    return got(sim), counters, [each.bursts for each in sim.stations.values()]


@pytest.mark.slow
def test_the_same_seed_gives_the_same_and_another_does_not():
    assert outcome(1) == outcome(1)
    assert outcome(1) != outcome(2)


@pytest.mark.slow
def test_it_may_be_run_in_steps():
    arrivals = small_messages(3, 10.0, 3.0, 1)
    ends = []
    for steps in (1, 40):
        sim = simulation("tdma", arrivals, air=AirParams(snr_db=25.0), pdu_size=128, seed=1)
        for step in range(steps):
            sim.run(4.0 * (step + 1) / steps)
        assert sim.now == 4.0
        ends.append(got(sim))
    assert ends[0] == ends[1]
