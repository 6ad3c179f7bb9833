"""Robots with real links on an air of bursts: who hears whom, what they send, what arrives."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import permutations
from random import Random
from typing import Literal, NamedTuple

from backends import AirParams, LinkOverride, Outage, RadioParams, Track, World
from benchmarks.worlds.arrivals import Arrival
from benchmarks.worlds.bursts import Simulation
from benchmarks.worlds.flight import Flight
from sdrlinkd.config import ModemParams
from sdrlinkd.link import (
    AccessParams,
    Burst,
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
from sdrlinkd.reports import LinkReport, RepeatReport
from sdrlinkd.wire import BROADCAST, Registry, make_registry

RATE_HZ = 5e6
MODEM = ModemParams(rate_hz=RATE_HZ, mcs=3, max_burst_s=0.02, block_s=1024 / RATE_HZ)
PDU_SIZE = 256
TURNAROUND_S = 1e-4
GOOD_DB, NONE_DB = 25.0, -300.0
CLOCK_PPM = 10.0
HOP_LIMIT = 8
CDR = b"\0\1\0\0"
TOPIC_TYPE = "std_msgs/msg/UInt8MultiArray"


Policy = Literal["csma", "minislot", "tdma", "grant", "auction"]


class Flow(NamedTuple):
    """`n` messages of `size` octets that robot `src` sends every `period_s` from `begin_s` on.

    Those to everyone are counted at robot `counted_at`. Flows of one name have the same topic.
    """

    name: str
    src: int
    dst: int
    size: int
    period_s: float
    n: int
    begin_s: float
    counted_at: int = BROADCAST
    qos: Literal["urgent", "latency", "default", "bulk"] = "default"
    lifespan_s: float | None = None
    """As the key of the topic; None: that of the class."""
    is_random: bool = False
    """Whether the messages come at random, every `period_s` on average."""
    least_s: float = 0.0
    """Least time between two messages, beside that."""

    def times(self, rng: Random) -> list[float]:
        """When the messages are sent, in s."""
        at, times = self.begin_s, []
        for _ in range(self.n):
            times.append(at)
            at += rng.expovariate(1 / self.period_s) if self.is_random else self.period_s
            at += self.least_s
        return times


@dataclass
class Heard:
    """When each message of a flow was sent, and came to its destination, by number; in s."""

    flow: Flow
    sent_at: Sequence[float]
    at: dict[int, float] = field(default_factory=dict)

    @property
    def mdr(self) -> float:
        """Messages that came over messages sent."""
        return len(self.at) / self.flow.n

    @property
    def delays_s(self) -> list[float]:
        """Of the messages that came."""
        return [at - self.sent_at[number] for number, at in self.at.items()]


class Strain(NamedTuple):
    """What makes the air of a team worse: robots that move, leave and come back, and losses."""

    tracks: Mapping[int, Track] = {}
    off: Mapping[int, Sequence[Outage]] = {}
    lost: float = 0.0
    """Probability that a robot does not get a PDU, beside what SNR and collisions cost."""
    keep_s: float = 0.0
    """Time for which the SNR of a pair counts."""
    relays: bool = True
    watch: Callable[[Flight, Burst], None] = lambda *_: None
    """Called with each burst of PDUs."""


class Team:
    """Robots `ids`, of which the pairs in `links` hear each other both ways.

    Without `links`, their tracks through `air` tell how well.
    """

    def __init__(
        self, ids: Iterable[int], links: Collection[tuple[int, int]] | None,
        flows: Sequence[Flow], seed: int, policy: Policy = "tdma", pdu_size: int = PDU_SIZE,
        turnaround_s: float = TURNAROUND_S, snr_db: float = GOOD_DB, modem: ModemParams = MODEM,
        air: AirParams | None = None, strain: Strain = Strain(),  # noqa: B008  # never changed
    ) -> None:  # fmt: skip
        self._pdu_size = pdu_size
        self._relay = RelayParams(policy="auto" if strain.relays else "none")
        self._topics = [*dict.fromkeys(flow.name for flow in flows)]
        self.ids = list(ids)
        self.heard = [
            Heard(flow, flow.times(Random(1000 * seed + i))) for i, flow in enumerate(flows)
        ]
        chance = Random(seed)
        self._by_topic = {
            (self._topics.index(heard.flow.name), heard.flow.src): heard for heard in self.heard
        }
        air = air or AirParams(rate_hz=RATE_HZ, block_s=modem.block_s, snr_db=snr_db)
        deaf = [
            LinkOverride(sender=a, receiver=b, snr_db=NONE_DB)
            for a, b in permutations(self.ids, 2)
            if links is not None and (a, b) not in links and (b, a) not in links
        ]
        registry = make_registry([(name, TOPIC_TYPE) for name in self._topics])
        radios = {
            node: RadioParams(
                full_duplex=False, turnaround_s=turnaround_s,
                clock_ppm=chance.uniform(-CLOCK_PPM, CLOCK_PPM),
            )
            for node in self.ids
        }  # fmt: skip
        self.simulation = Simulation(
            air,
            World(air, dict(strain.tracks), deaf, off=strain.off),
            radios,
            {node: self._link(node, registry, seed) for node in self.ids},
            modem,
            Airtimes(modem, pdu_size),
            AccessParams(policy=policy, nodes=self.ids, force=True),
            {node: self._arrivals(node) for node in self.ids},
            seed=seed,
            listen=self._listen,
            keep_s=strain.keep_s,
            lost=strain.lost,
            watch=strain.watch,
        )

    def forwarded_by(self, node: int, src: int, dst: int) -> list[int]:
        """Whom a robot names to forward PDUs of `src` to `dst`."""
        for flow in self._report(node).routes.flows:
            if (flow.src, flow.dst) == (src, dst):
                return flow.forwarded_by
        return []

    def repeats(self, node: int) -> RepeatReport:
        """What a robot repeated and asked for."""
        return self._report(node).repeats

    def forwarded(self, node: int) -> int:
        """How many PDUs of others a robot forwarded."""
        return self._report(node).relayed.sent

    def control_s(self) -> float:
        """Airtime in s of all PDUs that hold only records, and of pulses, so far."""
        return sum(self._report(node).control_airtime_s for node in self.ids)

    def control_share(self) -> float:
        """The same, as a share of the time so far."""
        return self.control_s() / self.simulation.now

    def _report(self, node: int) -> LinkReport:
        return self.simulation.stations[node].link.report(self.simulation.now)

    def _link(self, node: int, registry: Registry, seed: int) -> Link:
        link = Link(
            LinkParams(pdu_size=self._pdu_size, hop_limit=HOP_LIMIT),
            QueueParams(),
            ReassemblyParams(),
            registry,
            node,
            Random(100 * seed + node),
            relay=self._relay,
            clock=ClockParams(),
            repeat=RepeatParams(),
        )
        link.set_policies(
            {
                topic_id: TopicPolicy(
                    dst=each.flow.dst, qos=each.flow.qos, lifespan_s=each.flow.lifespan_s
                )
                for (topic_id, _), each in self._by_topic.items()
            }
        )
        return link

    def _arrivals(self, node: int) -> Iterator[Arrival]:
        """The messages of a robot in order of time; each begins with its number."""
        coming = sorted(
            (at, topic_id, number, heard.flow.size)
            for (topic_id, src), heard in self._by_topic.items()
            if src == node
            for number, at in enumerate(heard.sent_at)
        )
        for at, topic_id, number, size in coming:
            yield Arrival(at, topic_id, CDR + number.to_bytes(4, "little") + bytes(size))

    def _listen(self, node: int, message: Delivered, now: float) -> None:
        heard = self._by_topic[message.topic_id, message.src]
        if node in (heard.flow.dst, heard.flow.counted_at):
            heard.at.setdefault(int.from_bytes(message.payload[4:8], "little"), now)
