"""A scenario: the air, the robots on it and what they send, as TOML."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from backends import AirParams, LinkOverride, Outage, RadioParams, Track, World
from sdrlinkd.config import parse_toml
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.lab.traces import read_outages
from sdrlinkd.link import LinkParams

MAX_ROBOTS = 64
# Highest plausible speed.
MAX_SPEED_M_S = 1e4
# SNR in dB below which not even a preamble is detected.
LEAST_SNR_DB = -6.0
REACH_STEPS = 200

Waypoint = Annotated[list[float], Meta(min_length=3, max_length=3)]
Period = Annotated[list[float], Meta(min_length=2, max_length=2)]


class RobotParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One robot: its path, its radio and what it sends."""

    id: Annotated[int, Meta(ge=0, le=254)]
    path: list[Waypoint] = []
    """Waypoints [t in s, x in m, y in m], connected by straight lines; it stays at the last one."""
    topics: list[str] = []
    """Topics of the recording, or of the built-in robot, that it sends; []: all."""
    sends: bool = True
    off: list[Period] = []
    """Times at which its radio is off, as [begin, end] in s: before it joins, or once it has
    failed."""
    radio: RadioParams = RadioParams()


class OutageParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Outages: times at which nothing gets through."""

    trace: str = ""
    """Log of received messages with sequence numbers, one JSON object per line, in the folder of
    --traces; where messages are missing, there is an outage."""
    period_s: Annotated[float, Meta(gt=0)] = 0.5
    """Time between two messages of the log, in s."""
    from_s: Annotated[float, Meta(ge=0)] = 0.0
    """Time in the log at which the run starts, in s."""
    times: list[Period] = []
    """Further outages, as [begin, end] in s."""


class Scenario(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A whole experiment: its air, robots, links, and times."""

    title: str = ""
    pace: Literal["realtime", "lockstep"] = "realtime"
    """realtime: in real time; lockstep: as fast as the slowest node, with the same result for the
    same seed."""
    duration_s: Annotated[float, Meta(gt=0, le=1e5)] = 20.0
    """Time for which the robots send, in s."""
    settle_s: Annotated[float, Meta(ge=0, le=100)] = 2.0
    """Time after that for messages in transit, in s."""
    seed: Annotated[int, Meta(ge=0, lt=1 << 31)] = 1
    bag: str = ""
    """Recording that the robots send; "": the built-in robot. --bag overrides it."""
    air: AirParams = AirParams()
    robot: Annotated[list[RobotParams], Meta(min_length=1, max_length=MAX_ROBOTS)]
    link: list[LinkOverride] = []
    outages: OutageParams = OutageParams()
    daemon: dict[str, Any] = {}
    """Keys of sdrlinkd.toml for all daemons."""

    @property
    def radios(self) -> dict[int, RadioParams]:
        """The radio of each robot, by its id."""
        return {robot.id: robot.radio for robot in self.robot}

    @property
    def until_s(self) -> float:
        """End of the experiment, in s of its time."""
        return self.duration_s + self.settle_s

    @property
    def relays(self) -> bool:
        """Whether robots forward what others send."""
        return bool(self.daemon.get("relay", {}).get("policy", "none") != "none")

    @property
    def hop_limit(self) -> int:
        """The longest path in hops, as the daemons have it."""
        return int(self.daemon.get("link", {}).get("hop_limit", LinkParams().hop_limit))

    def in_reach(self, sender: int, receiver: int) -> bool:
        """Whether `receiver` can ever hear `sender`, possibly through others."""
        if not self.relays:
            return self.hears(receiver, sender)
        known, new = set[int](), {sender}
        while new:
            known |= new
            new = {
                robot.id
                for robot in self.robot
                if robot.id not in known and any(self.hears(robot.id, each) for each in new)
            }
        return receiver in known

    def hears(self, receiver: int, sender: int) -> bool:
        """Whether `receiver` can ever hear `sender` itself."""
        world = self.world([])
        times = [self.duration_s * i / REACH_STEPS for i in range(REACH_STEPS + 1)]
        hops = [world.hop(sender, receiver, t) for t in times]
        return any(hop is not None and hop.snr_db > LEAST_SNR_DB for hop in hops)

    def world(self, outages: list[Outage]) -> World:
        """The world that says where everything is."""
        off = {robot.id: [Outage(*each) for each in robot.off] for robot in self.robot if robot.off}
        return World(self.air, self.tracks, self.link, outages, off)

    @property
    def tracks(self) -> dict[int, Track]:
        """Where each robot with a path is at any time, by its id."""
        return {
            robot.id: Track([(t, x, y) for t, x, y in robot.path])
            for robot in self.robot
            if robot.path
        }


def load_scenario(path: Path) -> Scenario:
    """The scenario in `path`. Raises ConfigError that cites key, given and allowed."""
    try:
        text = path.read_text()
    except (OSError, ValueError) as error:
        raise UserError(
            f"{path}: cannot be read ({error}); scenarios are TOML files such as those in "
            "etc/scenarios"
        ) from None
    scenario = parse_toml(text, str(path), Scenario)
    _check(scenario, str(path))
    return scenario


def outages_of(scenario: Scenario, traces: Path | None) -> list[Outage]:
    """All outages of a run. Raises UserError if the log cannot be found."""
    params = scenario.outages
    outages = [Outage(begin, end) for begin, end in params.times]
    if params.trace:
        if traces is None:
            raise UserError(
                f"the scenario replays the outages of {params.trace}; give its folder with --traces"
            )
        outages += read_outages(traces / params.trace, params.period_s, params.from_s)
    return outages


def _check(scenario: Scenario, source: str) -> None:
    _check_numbers(scenario, source)
    ids = [robot.id for robot in scenario.robot]
    for robot_id in ids:
        if ids.count(robot_id) > 1:
            raise ConfigError(
                f"{source}: robot.id: got {robot_id} twice; allowed: a unique id for each robot"
            )
    for robot in scenario.robot:
        _check_path(robot, source)
    for link in scenario.link:
        for key, robot_id in (("sender", link.sender), ("receiver", link.receiver)):
            if robot_id not in ids:
                raise ConfigError(
                    f"{source}: link.{key}: got {robot_id}; allowed: a robot of this scenario: "
                    f"{', '.join(map(str, ids))}"
                )
        if link.sender == link.receiver:
            raise ConfigError(
                f"{source}: link: got robot {link.sender} to itself; allowed: two robots"
            )
    periods = [("outages.times", each) for each in scenario.outages.times]
    periods += [
        ("air.jammer.times", each) for jammer in scenario.air.jammer for each in jammer.times
    ]
    periods += [
        (f"robot.off of robot {robot.id}", each) for robot in scenario.robot for each in robot.off
    ]
    for key, (begin, end) in periods:
        if end <= begin:
            raise ConfigError(
                f"{source}: {key}: got [{begin:g}, {end:g}]; allowed: an end after its start"
            )


def _check_numbers(scenario: Scenario, source: str) -> None:
    lists = [("outages.times", times) for times in scenario.outages.times]
    lists += [
        ("air.jammer.times", times) for jammer in scenario.air.jammer for times in jammer.times
    ]
    lists += [("robot.off", times) for robot in scenario.robot for times in robot.off]
    lists += [("robot.path", place) for robot in scenario.robot for place in robot.path]
    for key, numbers in lists:
        if not all(map(math.isfinite, numbers)):
            raise ConfigError(f"{source}: {key}: got {numbers}; allowed: finite numbers")


def _check_path(robot: RobotParams, source: str) -> None:
    for (t0, x0, y0), (t1, x1, y1) in pairwise(robot.path):
        if t1 <= t0:
            raise ConfigError(
                f"{source}: robot.path of robot {robot.id}: got t = {t1:g} s after {t0:g} s; "
                "allowed: increasing times"
            )
        speed = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5 / (t1 - t0)
        if speed > MAX_SPEED_M_S:
            raise ConfigError(
                f"{source}: robot.path of robot {robot.id}: got {speed:.3g} m/s from {t0:g} s to "
                f"{t1:g} s; allowed: at most {MAX_SPEED_M_S:g} m/s"
            )
