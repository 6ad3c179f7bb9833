"""A team with the files that `init` writes, as whole links in virtual time."""

import struct
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from random import Random
from typing import Literal, NamedTuple

from backends import AirParams, Outage, RadioParams, World
from benchmarks.worlds.arrivals import Arrival
from benchmarks.worlds.bursts import Simulation
from sdrlinkd.config import Config, load_config, make_setup
from sdrlinkd.daemon import link_of
from sdrlinkd.init import RADIOS, REGISTRY, Team, team_files
from sdrlinkd.link import AS_CONFIGURED, Delivered, Overrides
from sdrlinkd.modem import Airtimes
from sdrlinkd.offers import Declaration
from sdrlinkd.policies import Policies
from sdrlinkd.sealing import Key, Remembered, Sealing

SENDER, LISTENER = 1, 2
MCS = 3
"""16QAM 1/2, where `init` writes that the link adapts."""
SNR_DB = 25.0
CDR = b"\0\1\0\0"
KEY = Key(0, bytes(range(32)))
NEW = Remembered({KEY.fingerprint: 0})
"""What is on disk of a key that was never used."""
REMEMBER_S = 0.1
"""Time in s between two times that a robot's disk takes what its sealing must remember."""
_NUMBER = struct.Struct("<I")


class Flow(NamedTuple):
    """A topic that a robot declares, and when it has messages of how many bytes.

    The topics of all robots of a drive have different names.
    """

    name: str
    type: str
    size: int
    times: Sequence[float]
    reliability: Literal["reliable", "best_effort"] = "reliable"
    durability: Literal["volatile", "transient_local"] = "volatile"
    depth: int = 0
    to: int | None = None
    """The robot that it commands."""
    sender: int = SENDER

    @property
    def topic(self) -> str:
        """Its name on the bus."""
        return f"/robot_{self.sender}/{self.name}"

    @property
    def declaration(self) -> Declaration:
        """What its producer tells of it."""
        return Declaration(
            name=self.topic, type=self.type, reliability=self.reliability,
            durability=self.durability, depth=self.depth,
        )  # fmt: skip


class Air(NamedTuple):
    """The air of a drive; MCS None: it adapts, as `init` writes.

    The sender's radio sends nothing in the period `silent`, and nothing is heard in `unheard`. With
    `react_s`, a radio needs so long from hearing to sending, in s.
    """

    mcs: int | None = MCS
    is_half_duplex: bool = False
    silent: Outage = Outage(0.0, 0.0)
    unheard: Outage = Outage(0.0, 0.0)
    react_s: float = 0.0
    rate: str = ""
    """Rate of the channel, as text; empty: as `init` writes it."""
    is_sealed: bool = False


FULL_DUPLEX = Air()


class Drive(NamedTuple):
    """The age in s at which each message arrived, by topic and number, and the settings."""

    ages_s: Mapping[str, Mapping[int, float]]
    config: Config


def robots_of(flows: Sequence[Flow]) -> range:
    """The robots of a team with these flows: two, or more if more of them send."""
    return range(1, 1 + max(LISTENER, *(flow.sender for flow in flows)))


def listener_of(flow: Flow, robots: Sequence[int]) -> int:
    """The robot at which messages count as arrived: the one after their sender."""
    return robots[robots.index(flow.sender) + 1 - len(robots)]


def drive(flows: Sequence[Flow], until_s: float, seed: int, air: Air = FULL_DUPLEX) -> Drive:
    """Let the robots send all messages of `flows`, and hear each other, until then."""
    robots, rng = robots_of(flows), Random(seed)
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        setups = {
            node: make_setup(load_config(path), directory)
            for node, path in written(
                directory, air.mcs, air.rate, robots, is_sealed=air.is_sealed
            ).items()
        }
    config = setups[SENDER].config
    sealing = {
        node: Sealing(
            node,
            config.link.pdu_size,
            config.security,
            [KEY],
            NEW,
            rng.randbytes,
        )
        for node in robots
        if air.is_sealed
    }
    links = {
        node: link_of(each, Random(100 * seed + node), sealing.get(node))
        for node, each in setups.items()
    }
    policies = {node: Policies(setup, links[node]) for node, setup in setups.items()}
    topics: dict[tuple[int, int], Flow] = {}
    for flow in flows:
        node, declaration = flow.sender, flow.declaration
        offer = declaration.offer(setups[node].name_on_air(declaration.name))
        topic_id = links[node].declare(offer).id
        policies[node].offer(topic_id, declaration)
        topics[node, topic_id] = flow
    ages: dict[str, dict[int, float]] = {flow.name: {} for flow in flows}

    def listen(node: int, message: Delivered, now: float) -> None:
        flow = topics[message.src, message.topic_id]
        if node == listener_of(flow, robots):
            number = _NUMBER.unpack_from(message.payload, len(CDR))[0]
            ages[flow.name].setdefault(number, now - flow.times[number])

    params = AirParams(rate_hz=config.modem.rate_hz, block_s=config.modem.block_s, snr_db=SNR_DB)
    world = World(params, {}, [], [air.unheard] if any(air.unheard) else [])
    simulation = Simulation(
        params, world,
        {node: RadioParams(full_duplex=not air.is_half_duplex) for node in links}, links,
        config.modem, Airtimes(config.modem, config.link.pdu_size), config.access,
        {node: _arrivals(node, topics) for node in robots}, rate=config.rate, seed=seed,
        fit=lambda traits: traits._replace(react_s=max(traits.react_s, air.react_s)),
        listen=listen,
    )  # fmt: skip
    for i in range(int(until_s / REMEMBER_S)):
        for each in sealing.values():
            simulation.call(i * REMEMBER_S, partial(_remember, each, i * REMEMBER_S))
    if any(air.silent):
        begin_s, end_s = air.silent
        simulation.call(begin_s, lambda: simulation.silence(SENDER, end_s))
    simulation.run(until_s)
    return Drive(ages, config)


def written(
    directory: Path, mcs: int | None, rate: str = "",
    robots: Sequence[int] = (SENDER, LISTENER), *, is_sealed: bool = False,
) -> dict[int, Path]:  # fmt: skip
    """The files of `init` for a team whose producers declare their topics, with a fixed MCS.

    `rate` is that of the channel, as text; empty: as `init` writes it.
    """
    radio = RADIOS["ether"]
    radio = radio._replace(rate=rate or radio.rate)
    team = Team(radio, len(robots), "", "", [], directory, directory, is_sealed=is_sealed)
    for name, text in team_files(team, list(robots)).items():
        if name != REGISTRY:
            lines = text.splitlines()
            if mcs is not None:
                fixed = text.replace("\nmcs = 1 ", f"\nmcs = {mcs} ").replace("adapt = true", "")
                lines = fixed.splitlines()
            declared = [line for line in lines if not line.startswith("registry =")]
            (directory / name).write_text("\n".join(declared))
    return {node: directory / f"robot_{node}.toml" for node in robots}


def _remember(sealing: Sealing, now: float) -> None:
    wanted = sealing.memory.wanted(now)
    if wanted is not None:
        sealing.memory.written(wanted)


def _arrivals(node: int, topics: Mapping[tuple[int, int], Flow]) -> Iterator[Arrival]:
    """All messages of a robot in order of time; each begins with its number."""
    due = [
        (at, topic_id, n)
        for (src, topic_id), flow in topics.items()
        for n, at in enumerate(flow.times)
        if src == node
    ]
    for at, topic_id, n in sorted(due):
        flow = topics[node, topic_id]
        wishes = AS_CONFIGURED if flow.to is None else Overrides(dst=flow.to)
        yield Arrival(at, topic_id, (CDR + _NUMBER.pack(n)).ljust(flow.size, b"\0"), wishes)
