"""What each robot of a scenario sends, and the configuration of its daemon."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from sdrlinkd.config import parse_config
from sdrlinkd.demo import Source, open_source
from sdrlinkd.errors import ConfigError
from sdrlinkd.lab.scenario import RobotParams, Scenario

SEED_STEP = 1000


def open_sources(scenario: Scenario, bag: Path | None) -> dict[int, Source]:
    """By robot. Raises UserError."""
    return {
        robot.id: open_source(
            bag,
            None,
            robot.topics,
            scenario.duration_s,
            seed_of(scenario, robot),
            namespace=f"robot_{robot.id}",
        )
        for robot in scenario.robot
    }


def seed_of(scenario: Scenario, robot: RobotParams) -> int:
    """A robot's own chance."""
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

    Raises ConfigError when the scenario's [daemon] does not fit; `name` is the scenario's.
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
    }
    if scenario.pace == "lockstep" and robot.sends:
        given["play"] = {
            "bag": str(bag.absolute()) if bag else "",
            "duration_s": scenario.duration_s,
        }
    merged = _merged(given, scenario.daemon)
    for section, key in (("modem", "rate_hz"), ("modem", "frequency_hz")):
        if merged[section][key] != given[section][key]:
            raise ConfigError(
                f"{name}: daemon.{section}.{key}: got {merged[section][key]:g}; allowed: that of "
                f"[air], {given[section][key]:g}"
            )
    text = tomli_w.dumps(merged)
    parse_config(text, f"{name}: [daemon]")
    path = folder / "sdrlinkd.toml"
    path.write_text(text)
    return path


def _merged(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """`one`, with what `other` says in its place, table by table."""
    merged = dict(one)
    for key, value in other.items():
        there = merged.get(key)
        merged[key] = (
            _merged(there, value) if isinstance(there, dict) and isinstance(value, dict) else value
        )
    return merged
