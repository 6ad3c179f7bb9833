"""The paper's flows over our link, in lock-step on the air clock: real links, an air of bursts."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from random import Random
from typing import NamedTuple

import msgspec
import numpy as np

from backends import AirParams, LinkOverride, Outage, RadioParams, World
from benchmarks.flows import Flow, Times, Trace
from benchmarks.worlds.arrivals import Arrival
from benchmarks.worlds.bursts import Simulation
from sdrlinkd.config import ModemParams
from sdrlinkd.link import (
    AccessParams,
    BulkParams,
    ClassesParams,
    ClockParams,
    Delivered,
    Link,
    LinkParams,
    QueueParams,
    ReassemblyParams,
    RelayParams,
    RepeatParams,
    TopicPolicy,
)
from sdrlinkd.modem import Airtimes
from sdrlinkd.wire import Registry, make_registry

RATE_HZ = 5e6
MCS = 3
SNR_DB = 25.0
BLOCK_S = 1024 / RATE_HZ
PDU_SIZE = 1058
"""One message of 1 KB as CDR (1032 B) with its STAMP."""
MAX_BURST_S = 0.02
BULK_BURST_S = 0.003
SETTLE_S = 1.0
CDR = b"\0\1\0\0"
NO_POLICIES: Mapping[int, TopicPolicy] = {}
Listen = Callable[[int, Delivered, float], None]


class Sent(NamedTuple):
    """A flow with the robots that send and receive it."""

    flow: Flow
    src: int
    dst: int


class Air(NamedTuple):
    """The robots, and how they share the air."""

    nodes: int = 2
    policy: str = "none"
    full_duplex: bool = True
    """Whether each direction has an air of its own; otherwise both share one."""
    turnaround_s: float = 0.0
    overrides: Sequence[LinkOverride] = ()
    max_burst_s: float = MAX_BURST_S
    classes: ClassesParams = ClassesParams(bulk=BulkParams(max_burst_s=BULK_BURST_S))
    block_s: float = BLOCK_S
    pdu_size: int = PDU_SIZE
    routes: Mapping[int, Sequence[str]] = {}
    """The topics that each relay forwards."""
    learns_routes: bool = False
    """Whether the robots learn them instead."""
    off: Mapping[int, Sequence[Outage]] = {}
    """When the radios of some robots are off."""


class Run(NamedTuple):
    """The outcome of all flows."""

    traces: list[Trace]
    simulation: Simulation


class Experiment(NamedTuple):
    """Robots and their traffic, before the start."""

    sent: Sequence[Sent]
    times: list[Times]
    heard: list[Times]
    simulation: Simulation
    own_s: float
    """Airtime of a burst of one PDU."""

    def finish(self, until_s: float | None = None) -> list[Trace]:
        """Run until everything has had time to arrive."""
        last = max((float(each[-1]) for each in self.times if len(each)), default=0.0)
        self.simulation.run(last + SETTLE_S if until_s is None else until_s)
        return [
            Trace(each.flow, *both)
            for each, *both in zip(self.sent, self.times, self.heard, strict=True)
        ]


def by_class(flow: Flow) -> TopicPolicy:
    """A policy for the flow's class that keeps every message."""
    return TopicPolicy(qos=flow.qos)  # type: ignore[arg-type]


def run(sent: Sequence[Sent], air: Air, seed: int) -> Run:
    """Run all flows, from producer to consumer."""
    experiment = prepare(sent, air, seed)
    return Run(experiment.finish(), experiment.simulation)


def prepare(
    sent: Sequence[Sent],
    air: Air,
    seed: int,
    policy: Callable[[Flow], TopicPolicy] = by_class,
) -> Experiment:
    """Set up an experiment with all flows."""
    rng = np.random.default_rng(seed)
    names = [each.flow.name for each in sent]
    registry = make_registry([(name, "std_msgs/msg/UInt8MultiArray") for name in names])
    times = [each.flow.times(rng) for each in sent]
    heard = [np.full(each.flow.count, np.nan) for each in sent]
    nodes = range(1, air.nodes + 1)
    policies = {
        i: msgspec.structs.replace(policy(each.flow), dst=each.dst) for i, each in enumerate(sent)
    }
    simulation = simulate(
        registry,
        air,
        {node: float(rng.uniform(-10, 10)) for node in nodes},
        {node: _arrivals(node, sent, times) for node in nodes},
        _note(sent, heard),
        seed,
        policies,
    )
    own_s = Airtimes(modem_on(air), air.pdu_size).airtime_s(MCS, 1)
    return Experiment(sent, times, heard, simulation, own_s)


def modem_on(air: Air) -> ModemParams:
    """The modem settings of every robot."""
    return ModemParams(rate_hz=RATE_HZ, mcs=MCS, max_burst_s=air.max_burst_s, block_s=air.block_s)


def simulate(
    registry: Registry,
    air: Air,
    clocks_ppm: Mapping[int, float],
    arrivals: Mapping[int, Iterable[Arrival]],
    listen: Listen,
    seed: int,
    policies: Mapping[int, TopicPolicy] = NO_POLICIES,
) -> Simulation:
    """Robots with links of their own; `clocks_ppm` lists them."""
    params = AirParams(rate_hz=RATE_HZ, block_s=air.block_s, snr_db=SNR_DB)
    radio = RadioParams(full_duplex=air.full_duplex, turnaround_s=air.turnaround_s)
    links = {}
    for node in clocks_ppm:
        relay = RelayParams(policy="auto") if air.learns_routes else RelayParams()
        if node in air.routes:
            relay = RelayParams(policy="routes", routes=list(air.routes[node]))
        hop_limit = air.nodes if air.learns_routes else 1 + len(air.routes)
        links[node] = Link(
            LinkParams(pdu_size=air.pdu_size, hop_limit=hop_limit),
            QueueParams(),
            ReassemblyParams(),
            registry,
            node,
            Random(100 * seed + node),
            classes=air.classes,
            relay=relay,
            clock=ClockParams(),
            repeat=RepeatParams(),
        )
        links[node].set_policies(policies)
    modem = modem_on(air)
    return Simulation(
        params,
        World(params, {}, list(air.overrides), off=air.off),
        {node: msgspec.structs.replace(radio, clock_ppm=ppm) for node, ppm in clocks_ppm.items()},
        links,
        modem,
        Airtimes(modem, air.pdu_size),
        AccessParams(policy=air.policy, nodes=list(clocks_ppm), force=True),  # type: ignore[arg-type]
        arrivals,
        seed=seed,
        listen=listen,
    )


def _arrivals(
    node: int,
    sent: Sequence[Sent],
    times: Sequence[Times],
) -> Iterator[Arrival]:
    """Messages of one robot in order of time; each starts with its number."""
    mine = [
        (float(at), topic_id, number)
        for topic_id, each in enumerate(sent)
        if each.src == node
        for number, at in enumerate(times[topic_id])
    ]
    for at, topic_id, number in sorted(mine):
        # CDR puts the encapsulation and the sequence's length before the bytes.
        payload = CDR + number.to_bytes(4, "little") + bytes(sent[topic_id].flow.size)
        yield Arrival(at, topic_id, payload)


def _note(
    sent: Sequence[Sent],
    heard: Sequence[Times],
) -> Listen:
    def note(node: int, message: Delivered, now: float) -> None:
        if node == sent[message.topic_id].dst:
            heard[message.topic_id][int.from_bytes(message.payload[4:8], "little")] = now

    return note
