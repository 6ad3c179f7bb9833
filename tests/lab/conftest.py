"""Scenarios from text, and the configurations that a lab derives from them."""

import pytest

from sdrlinkd.lab import load_scenario
from sdrlinkd.lab.testing import open_sources, write_daemon_config


@pytest.fixture
def load(tmp_path):
    """Loads a scenario from TOML text in the file s.toml."""

    def call(text):
        (tmp_path / "s.toml").write_text(text)
        return load_scenario(tmp_path / "s.toml")

    return call


@pytest.fixture
def write_configs(tmp_path):
    """Write the configurations of all daemons of a scenario; returns their paths."""

    def call(scenario, bag=None, name="s.toml"):
        sources = open_sources(scenario, bag)
        try:
            return [
                write_daemon_config(
                    tmp_path / f"robot_{robot.id}",
                    scenario,
                    robot,
                    sources[robot.id],
                    bag,
                    tmp_path / "hub",
                    name,
                )
                for robot in scenario.robot
            ]
        finally:
            for source in sources.values():
                source.recording.close()

    return call
