"""A team with the files that `init` writes, as whole links in virtual time."""

import struct
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from random import Random
from typing import NamedTuple

from backends import AirParams, RadioParams, World
from benchmarks.worlds.arrivals import Arrival
from benchmarks.worlds.bursts import Simulation
from sdrlinkd.config import Setup, load_config, make_setup
from sdrlinkd.init import RADIOS, REGISTRY, FoundTopic, Team, team_files
from sdrlinkd.link import Delivered, Link
from sdrlinkd.modem import Airtimes
from sdrlinkd.offers import Declaration
from sdrlinkd.policies import Policies

SNR_DB = 25.0
CDR = b"\0\1\0\0"
_NUMBER = struct.Struct("<I")


class Flow(NamedTuple):
    """A topic of robot `src`: its offer, and when it has messages of how many bytes."""

    name: str
    type: str
    size: int
    times: Sequence[float]
    is_reliable: bool = True
    src: int = 1


class Outcome(NamedTuple):
    """What became of a flow: the age in s at which each message that arrived did so, by number."""

    flow: Flow
    ages_s: Mapping[int, float]
    dropped: Mapping[str, int]

    @property
    def delivered(self) -> float:
        """Share of the messages that arrived."""
        return len(self.ages_s) / max(1, len(self.flow.times))

    def quantile_s(self, share: float) -> float:
        """The age in s that this share of the messages that arrived did not exceed."""
        ages = sorted(self.ages_s.values())
        return ages[min(len(ages) - 1, int(share * len(ages)))] if ages else float("inf")


class Drive(NamedTuple):
    """The outcomes of all flows, by topic, and the robots' settings."""

    outcomes: Mapping[str, Outcome]
    setup: Setup
    air_share: float
    """Share of the time in which robot 1 sent."""


def drive(
    flows: Sequence[Flow], until_s: float, seed: int, *, robots: int = 2, mcs: int = 3,
    rate: str = "5 Msps", declared: bool = True,
) -> Drive:  # fmt: skip
    """Let robot 2 hear what the others send of `flows`; all messages have until `until_s`.

    The topics are `declared` by their producers, or else in a registry that `init` wrote.
    """
    with tempfile.TemporaryDirectory() as directory:
        setups = _written(Path(directory), robots, mcs, rate, flows, declared=declared)
    config = setups[1].config
    links = {node: _link(setup, Random(100 * seed + node)) for node, setup in setups.items()}
    topics = {}
    for flow in flows:
        setup, link = setups[flow.src], links[flow.src]
        named = {topic.name: topic.id for topic in setup.registry.topics}
        if not declared:
            topics[flow.src, flow.name] = named[flow.name]
            continue
        policies = Policies(setup, link)
        declaration = Declaration(
            name=f"/robot_{flow.src}/{flow.name}", type=flow.type,
            reliability="reliable" if flow.is_reliable else "best_effort",
        )  # fmt: skip
        topic = link.declare(declaration.offer(setup.name_on_air(declaration.name)))
        policies.offer(topic.id, declaration)
        topics[flow.src, flow.name] = topic.id
    ages: dict[tuple[int, str], dict[int, float]] = {key: {} for key in topics}
    by_topic = {(src, number): (src, name) for (src, name), number in topics.items()}
    sent = {(flow.src, flow.name): flow for flow in flows}

    def listen(node: int, message: Delivered, now: float) -> None:
        key = by_topic.get((message.src, message.topic_id))
        if node == 2 and key is not None:
            number = _NUMBER.unpack_from(message.payload, len(CDR))[0]
            ages[key].setdefault(number, now - sent[key].times[number])

    params = AirParams(rate_hz=config.modem.rate_hz, block_s=config.modem.block_s, snr_db=SNR_DB)
    simulation = Simulation(
        params, World(params, {}, []), {node: RadioParams() for node in links}, links,
        config.modem, Airtimes(config.modem, config.link.pdu_size), config.access,
        {node: _arrivals([f for f in flows if f.src == node], topics) for node in links},
        rate=config.rate, seed=seed, listen=listen,
    )  # fmt: skip
    simulation.run(until_s)
    reports = {node: link.report(until_s) for node, link in links.items()}
    outcomes = {}
    for key, flow in sent.items():
        dropped = next(
            each.dropped for each in reports[flow.src].topics if each.topic_id == topics[key]
        )
        outcomes[flow.name] = Outcome(flow, ages[key], dropped)
    airtime_s = reports[1].airtime_s
    return Drive(outcomes, setups[1], airtime_s / until_s)


def _written(
    directory: Path, robots: int, mcs: int, rate: str, flows: Sequence[Flow], *, declared: bool
) -> dict[int, Setup]:
    """The settings of all robots as `init` writes them, but for rate and MCS."""
    known = {} if declared else {flow.name: flow.type for flow in flows}
    topics = [FoundTopic(*each) for each in known.items()]
    radio = RADIOS["ether"]._replace(rate=rate)
    team = Team(radio, robots, "", "", topics, directory, directory)
    for name, text in team_files(team, list(range(1, robots + 1))).items():
        if declared and name == REGISTRY:
            continue
        lines = text.replace("mcs = 1 ", f"mcs = {mcs} ").splitlines()
        kept = [line for line in lines if not (declared and line.startswith("registry ="))]
        (directory / name).write_text("\n".join(kept))
    paths = {node: directory / f"robot_{node}.toml" for node in range(1, robots + 1)}
    return {node: make_setup(load_config(path), directory) for node, path in paths.items()}


def _link(setup: Setup, rng: Random) -> Link:
    config = setup.config
    return Link(
        config.link, config.queue, config.reassembly, setup.registry, setup.node_id, rng,
        classes=config.classes, relay=config.relay, repeat=config.repeat,
        admission=config.admission, clock=config.clock, dictionaries=setup.dictionaries,
        has_numbers=setup.has_numbers, max_expanded=config.bus.max_message_bytes,
    )  # fmt: skip


def _arrivals(flows: Sequence[Flow], topics: Mapping[tuple[int, str], int]) -> Iterator[Arrival]:
    due = sorted((at, n, flow) for flow in flows for n, at in enumerate(flow.times))
    for at, n, flow in due:
        payload = (CDR + _NUMBER.pack(n)).ljust(flow.size, b"\0")
        yield Arrival(at, topics[flow.src, flow.name], payload)
