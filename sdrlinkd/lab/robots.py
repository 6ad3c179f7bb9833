"""What each robot of a scenario sends, and the configuration of its daemon."""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from sdrlinkd.config import parse_config
from sdrlinkd.demo import Source, open_source
from sdrlinkd.errors import ConfigError, UserError
from sdrlinkd.lab.scenario import RobotParams, Scenario

SEED_STEP = 1000
# Keys of the daemons' configuration that the scenario determines.
OURS = (
    "namespace", "robot_id", "seed", "registry", "topics", "rx_format", "rx_depth", "backend",
    "play", "bus.runtime_dir", "ether.dir",
)  # fmt: skip
TABLES = ("modem", "access", "bus", "ether")


def open_sources(scenario: Scenario, bag: Path | None) -> dict[int, Source]:
    """The message source of each robot, by its id. Raises UserError."""
    try:
        return _open_sources(scenario, bag)
    except UserError as error:
        if bag is not None:
            raise
        raise UserError(f"{error}; give a recording that has it with --bag") from None


def _open_sources(scenario: Scenario, bag: Path | None) -> dict[int, Source]:
    return {
        robot.id: open_source(
            bag,
            None,
            robot.topics,
            scenario.duration_s,
            seed_of(scenario, robot),
            namespace=f"robot_{robot.id}",
            topics_key=f"robot.topics of robot {robot.id}",
        )
        for robot in scenario.robot
    }


def seed_of(scenario: Scenario, robot: RobotParams) -> int:
    """The seed of one robot's random numbers."""
    return scenario.seed * SEED_STEP + robot.id


def write_daemon_config(
    folder: Path,
    scenario: Scenario,
    robot: RobotParams,
    source: Source,
    bag: Path | None,
    hub: Path,
    name: str,
) -> Path:
    """The configuration of a robot's daemon, whose sockets are in `folder`.

    Raises ConfigError if the scenario's [daemon] is not valid; `name` is the scenario's name.
    """
    folder.mkdir()
    (folder / "registry.csv").write_text(source.registry.csv())
    prefix = f"/{source.namespace}/" if source.namespace else "/"
    given: dict[str, Any] = {
        "namespace": source.namespace,
        "robot_id": robot.id,
        "seed": seed_of(scenario, robot),
        "registry": "registry.csv",
        "topics": [topic.name.removeprefix(prefix) for topic in source.topics],
        "rx_depth": 0,
        "backend": "ether",
        "bus": {"runtime_dir": str(folder)},
        "ether": {"dir": str(hub)},
        "modem": {"rate_hz": scenario.air.rate_hz, "frequency_hz": scenario.air.frequency_hz},
        "access": {"nodes": [each.id for each in scenario.robot]},
        # Each message counts, as in the paper: none replaces another by its type.
        "topic": {topic.name: {"offer": False} for topic in source.registry.topics},
    }
    if scenario.pace == "lockstep":
        given["play"] = {
            "bag": str(bag.absolute()) if bag else "",
            "duration_s": scenario.duration_s if robot.sends else 0.0,
            "wait_for_consumer": True,
        }
    _refuse_ours(given, scenario.daemon, name)
    merged = _merged(given, scenario.daemon)
    text = tomli_w.dumps(merged)
    try:
        parse_config(text, f"{name}: [daemon]")
    except ConfigError as error:
        # Remove the line number, which is that of a temporary file.
        raise ConfigError(re.sub(r"(\[daemon\]):\d+", r"\1", str(error))) from None
    path = folder / "sdrlinkd.toml"
    path.write_text(text)
    return path


def _refuse_ours(given: Mapping[str, Any], wanted: Mapping[str, Any], name: str) -> None:
    """Refuse keys whose values only the lab can set. Raises ConfigError."""
    for section in TABLES:
        if not isinstance(wanted.get(section, {}), dict):
            raise ConfigError(
                f"{name}: daemon.{section}: got {json.dumps(wanted[section])}; allowed: a table"
            )
    for key in OURS:
        section, _, inner = key.partition(".")
        if section in wanted and (not inner or inner in wanted[section]):
            raise ConfigError(
                f"{name}: daemon.{key}: the lab sets it from [[robot]] and [air]; "
                "allowed: other keys of sdrlinkd.toml"
            )
    for key, value in wanted.get("modem", {}).items():
        ours = given["modem"].get(key)
        if ours is not None and value != ours:
            is_number = isinstance(value, int | float)
            got = f"{value:g}" if is_number else json.dumps(value, default=str)
            raise ConfigError(
                f"{name}: daemon.modem.{key}: got {got}; allowed: that of [air], {ours:g}"
            )


def _merged(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """`one`, overridden by `other`, table by table."""
    merged = dict(one)
    for key, value in other.items():
        there = merged.get(key)
        merged[key] = (
            _merged(there, value) if isinstance(there, dict) and isinstance(value, dict) else value
        )
    return merged
