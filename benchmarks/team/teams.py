"""Robots with real links on an air of bursts: who hears whom, what they send, what arrives."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import permutations
from random import Random
from typing import NamedTuple

import msgspec

from backends import AirParams, LinkOverride, RadioParams, World
from benchmarks.worlds.arrivals import Arrival
from benchmarks.worlds.bursts import Simulation
from sdrlinkd.config import ModemParams
from sdrlinkd.link import (
    AccessParams,
    ClassesParams,
    ClockParams,
    Delivered,
    Link,
    LinkParams,
    Overrides,
    QueueParams,
    ReassemblyParams,
    RelayParams,
    RepeatParams,
    TopicPolicy,
)
from sdrlinkd.modem import Airtimes
from sdrlinkd.wire import BROADCAST, make_registry

RATE_HZ = 5e6
MCS = 3
BLOCK_S = 1024 / RATE_HZ
TURNAROUND_S = 1e-4
GOOD_DB, NONE_DB = 25.0, -300.0
HOP_LIMIT = 8
CDR = b"\0\1\0\0"
TOPIC_TYPE = "std_msgs/msg/UInt8MultiArray"

Pairs = Collection[tuple[int, int]]


class Flow(NamedTuple):
    """Messages of `size` octets that robot `src` sends every `period_s` from `begin_s` on.

    Those to everyone are counted at robot `counted_at`.
    """

    name: str
    src: int
    dst: int
    size: int
    period_s: float
    n: int
    qos: str = "default"
    begin_s: float = 0.0
    lifespan_s: float = 0.0
    counted_at: int = BROADCAST


@dataclass
class Heard:
    """When each message of a flow came to its destination, by number; times in s."""

    flow: Flow
    sent_at: list[float]
    at: dict[int, float] = field(default_factory=dict)

    @property
    def delivered(self) -> float:
        """Share of the messages that came."""
        return len(self.at) / len(self.sent_at)

    def ages_s(self) -> list[float]:
        """The ages of those that came, in ascending order."""
        return sorted(at - self.sent_at[number] for number, at in self.at.items())


class Settings(NamedTuple):
    """How the robots of a team are set up."""

    policy: str = "tdma"
    relay: str = "auto"
    pdu_size: int = 256
    max_burst_s: float = 0.02
    turnaround_s: float = TURNAROUND_S
    share: float = 0.05
    classes: ClassesParams = ClassesParams()
    routes: Mapping[int, tuple[str, ...]] = {}
    """Routes by hand, by robot."""


class Team:
    """Robots `ids`, of which the pairs in `links` hear each other."""

    def __init__(
        self, ids: Iterable[int], links: Pairs, flows: Iterable[Flow], settings: Settings,
        seed: int,
    ) -> None:  # fmt: skip
        self.ids, flows = list(ids), list(flows)
        chance = Random(seed)
        self.links = set(links)
        air = AirParams(rate_hz=RATE_HZ, block_s=BLOCK_S, snr_db=GOOD_DB)
        overrides = [
            LinkOverride(sender=a, receiver=b, snr_db=NONE_DB)
            for a, b in permutations(self.ids, 2)
            if (a, b) not in self.links and (b, a) not in self.links
        ]
        registry = make_registry([(flow.name, TOPIC_TYPE) for flow in flows])
        modem = ModemParams(
            rate_hz=RATE_HZ, mcs=MCS, max_burst_s=settings.max_burst_s, block_s=BLOCK_S
        )
        self.heard = [
            Heard(flow, [flow.begin_s + flow.period_s * i for i in range(flow.n)]) for flow in flows
        ]
        links_of = {node: self._link(node, registry, settings, seed) for node in self.ids}
        for i, flow in enumerate(flows):
            policy = TopicPolicy(qos=flow.qos, dst=flow.dst)  # type: ignore[arg-type]
            if flow.lifespan_s:
                policy = msgspec.structs.replace(policy, lifespan_s=flow.lifespan_s)
            for link in links_of.values():
                link.set_policy(i, policy)
        radio = RadioParams(full_duplex=False, turnaround_s=settings.turnaround_s)
        self.simulation = Simulation(
            air,
            World(air, {}, overrides),
            {
                node: msgspec.structs.replace(radio, clock_ppm=chance.uniform(-10, 10))
                for node in self.ids
            },
            links_of,
            modem,
            Airtimes(modem, settings.pdu_size),
            AccessParams(policy=settings.policy, nodes=self.ids, force=True),  # type: ignore[arg-type]
            {node: self._arrivals(node) for node in self.ids},
            seed=seed,
            listen=self._listen,
        )

    def link(self, node: int) -> Link:
        """The link of a robot."""
        return self.simulation.stations[node].link

    def forwarded_by(self, node: int, src: int, dst: int) -> list[int]:
        """Whom a robot names to forward PDUs of `src` to `dst`."""
        flows = self.link(node).report(self.simulation.now).routes.flows
        return next((each.forwarded_by for each in flows if (each.src, each.dst) == (src, dst)), [])

    def control_share(self, since: float = 0.0) -> float:
        """Airtime of all PDUs that hold only records, as a share of the time."""
        used_s = sum(
            self.link(node).report(self.simulation.now).control_airtime_s for node in self.ids
        )
        return used_s / (self.simulation.now - since)

    def _link(self, node: int, registry: object, settings: Settings, seed: int) -> Link:
        relay = RelayParams(policy=settings.relay)  # type: ignore[arg-type]
        if settings.relay == "routes":
            routes = list(settings.routes.get(node, ()))
            relay = RelayParams(policy="routes" if routes else "none", routes=routes)
        return Link(
            LinkParams(pdu_size=settings.pdu_size, hop_limit=HOP_LIMIT),
            QueueParams(),
            ReassemblyParams(),
            registry,  # type: ignore[arg-type]
            node,
            Random(100 * seed + node),
            classes=settings.classes,
            relay=relay,
            clock=ClockParams(),
            repeat=RepeatParams(share=settings.share),
        )

    def _arrivals(self, node: int) -> list[Arrival]:
        mine = [
            (at, topic_id, number)
            for topic_id, heard in enumerate(self.heard)
            if heard.flow.src == node
            for number, at in enumerate(heard.sent_at)
        ]
        return [
            Arrival(
                at, topic_id,
                CDR + number.to_bytes(4, "little") + bytes(self.heard[topic_id].flow.size),
                Overrides(),
            )
            for at, topic_id, number in sorted(mine)
        ]  # fmt: skip

    def _listen(self, node: int, message: Delivered, now: float) -> None:
        heard = self.heard[message.topic_id]
        if node in (heard.flow.dst, heard.flow.counted_at):
            heard.at.setdefault(int.from_bytes(message.payload[4:8], "little"), now)
