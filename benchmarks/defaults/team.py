"""A team with the files that `init` writes, as whole links in virtual time."""

import struct
import tempfile
from collections.abc import Iterator, Mapping, Sequence
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

SENDER, LISTENER = 1, 2
MCS = 3
"""16QAM 1/2, where `init` writes that the link adapts."""
SNR_DB = 25.0
CDR = b"\0\1\0\0"
_NUMBER = struct.Struct("<I")


class Flow(NamedTuple):
    """A topic that the sender declares, and when it has messages of how many bytes."""

    name: str
    type: str
    size: int
    times: Sequence[float]
    reliability: Literal["reliable", "best_effort"] = "reliable"
    durability: Literal["volatile", "transient_local"] = "volatile"
    depth: int = 0
    to: int | None = None
    """The robot that it commands."""


class Air(NamedTuple):
    """The air of a drive; MCS None: it adapts, as `init` writes.

    The sender's radio sends nothing in the period `silent`, and nothing is heard in `unheard`.
    """

    mcs: int | None = MCS
    is_half_duplex: bool = False
    silent: Outage = Outage(0.0, 0.0)
    unheard: Outage = Outage(0.0, 0.0)


FULL_DUPLEX = Air()


class Drive(NamedTuple):
    """The age in s at which each message arrived, by topic and number, and the settings."""

    ages_s: Mapping[str, Mapping[int, float]]
    config: Config


def drive(flows: Sequence[Flow], until_s: float, seed: int, air: Air = FULL_DUPLEX) -> Drive:
    """Let one robot of two send all messages of `flows`, and the other hear them, until then."""
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        setups = {
            node: make_setup(load_config(path), directory)
            for node, path in written(directory, air.mcs).items()
        }
    setup = setups[SENDER]
    config = setup.config
    links = {node: link_of(each, Random(100 * seed + node)) for node, each in setups.items()}
    policies, topics = Policies(setup, links[SENDER]), {}
    for flow in flows:
        declaration = Declaration(
            name=f"/robot_{SENDER}/{flow.name}", type=flow.type,
            reliability=flow.reliability, durability=flow.durability, depth=flow.depth,
        )  # fmt: skip
        offer = declaration.offer(setup.name_on_air(declaration.name))
        topic_id = links[SENDER].declare(offer).id
        policies.offer(topic_id, declaration)
        topics[topic_id] = flow
    ages: dict[str, dict[int, float]] = {flow.name: {} for flow in flows}

    def listen(node: int, message: Delivered, now: float) -> None:
        if node == LISTENER:
            flow = topics[message.topic_id]
            number = _NUMBER.unpack_from(message.payload, len(CDR))[0]
            ages[flow.name].setdefault(number, now - flow.times[number])

    params = AirParams(rate_hz=config.modem.rate_hz, block_s=config.modem.block_s, snr_db=SNR_DB)
    world = World(params, {}, [], [air.unheard] if any(air.unheard) else [])
    simulation = Simulation(
        params, world,
        {node: RadioParams(full_duplex=not air.is_half_duplex) for node in links}, links,
        config.modem, Airtimes(config.modem, config.link.pdu_size), config.access,
        {SENDER: _arrivals(topics)}, rate=config.rate, seed=seed, listen=listen,
    )  # fmt: skip
    if any(air.silent):
        begin_s, end_s = air.silent
        simulation.call(begin_s, lambda: simulation.silence(SENDER, end_s))
    simulation.run(until_s)
    return Drive(ages, config)


def written(directory: Path, mcs: int | None, rate: str = "") -> dict[int, Path]:
    """The files of `init` for a team whose producers declare their topics, with a fixed MCS.

    `rate` is that of the channel, as text; empty: as `init` writes it.
    """
    radio = RADIOS["ether"]
    radio = radio._replace(rate=rate or radio.rate)
    team = Team(radio, 2, "", "", [], directory, directory)
    for name, text in team_files(team, [SENDER, LISTENER]).items():
        if name != REGISTRY:
            lines = text.splitlines()
            if mcs is not None:
                fixed = text.replace("\nmcs = 1 ", f"\nmcs = {mcs} ").replace("adapt = true", "")
                lines = fixed.splitlines()
            declared = [line for line in lines if not line.startswith("registry =")]
            (directory / name).write_text("\n".join(declared))
    return {node: directory / f"robot_{node}.toml" for node in (SENDER, LISTENER)}


def _arrivals(topics: Mapping[int, Flow]) -> Iterator[Arrival]:
    """All messages in order of time; each begins with its number."""
    due = [
        (at, topic_id, n) for topic_id, flow in topics.items() for n, at in enumerate(flow.times)
    ]
    for at, topic_id, n in sorted(due):
        flow = topics[topic_id]
        wishes = AS_CONFIGURED if flow.to is None else Overrides(dst=flow.to)
        yield Arrival(at, topic_id, (CDR + _NUMBER.pack(n)).ljust(flow.size, b"\0"), wishes)
