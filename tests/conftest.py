"""Fixtures that several folders use: real daemons."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis.strategies import text

import phy
from sdrlinkd.link import Lives
from tests.copied import origin
from tests.programs import Daemon
from tests.tiers import (
    pytest_collection_modifyitems,
    pytest_configure,
    pytest_terminal_summary,
)

__all__ = ["pytest_collection_modifyitems", "pytest_configure", "pytest_terminal_summary"]

ETC = Path(__file__).parents[1] / "etc"
# A daemon would count this and report it with its ledger.
Lives.is_strict = True


@pytest.hookimpl(trylast=True)  # Hypothesis refuses its table while it begins itself.
def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the modem once, before all workers, if its source has changed.

    A daemon that a test starts would take its messages meanwhile, and send none. Hypothesis makes
    its table of characters, which costs seconds in a new clone, and no test should pay for it.
    """
    if not hasattr(session.config, "workerinput"):
        phy.warm_up()
        text().validate()


@pytest.fixture(autouse=True)
def _no_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use the default width of tables, whatever the environment of the test run says."""
    monkeypatch.delenv("COLUMNS", raising=False)


EACH_COUNTS = """
[topic]
odom.depth = 0
scan.depth = 0
imu = { depth = 0, lifespan_s = inf }
cmd_vel.depth = 0
"""
"""Tests send bursts of messages and count them, of types of which only the newest is kept."""


def write_settings(directory: Path, extra_toml: str = "") -> Path:
    """Write a configuration with its sockets in `directory` and optional further TOML.

    Without a registry and policies of its own, each message of the shipped topics counts.
    """
    top, tables = [], extra_toml
    while tables and not tables.startswith("["):
        line, _, tables = tables.partition("\n")
        top.append(line)
    if not any(line.startswith("registry") for line in top):
        top.append(f'registry = "{ETC / "registry.csv"}"')
        if "[topic" not in tables:
            tables += EACH_COUNTS
    config = directory / "sdrlinkd.toml"
    config.write_text(
        "\n".join([*top, "seed = 1", "[bus]", f'runtime_dir = "{directory}"', tables])
    )
    return config


@contextlib.contextmanager
def daemons(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Daemon]]:
    """Starts daemons and stops them in order; each must end cleanly, without a traceback."""
    started: list[Daemon] = []

    def start(extra_toml: str = "", before: str = "") -> Daemon:
        """Start a daemon; `before` is Python code that it runs first."""
        directory = tmp_path_factory.mktemp("node")
        daemon = Daemon(directory, write_settings(directory, extra_toml), directory / "log", before)
        started.append(daemon)
        return daemon.at_work()

    yield start
    for daemon in started:
        daemon.ends_well()


@pytest.fixture
def write_config() -> Callable[..., Path]:
    """Writes a configuration with its sockets in the given folder and optional further TOML."""
    return write_settings


@pytest.fixture(scope="session")
def _loaded() -> None:
    """A program of which daemons are copies. That it loads is not charged to the first of them."""
    origin.loaded()


@pytest.fixture
def start_daemon(
    tmp_path_factory: pytest.TempPathFactory, _loaded: None
) -> Iterator[Callable[..., Daemon]]:
    """Starts daemons and stops them in order; each must end cleanly, without a traceback."""
    with daemons(tmp_path_factory) as start:
        yield start


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory, _loaded: None) -> Iterator[Daemon]:
    """One daemon with the default settings, for all tests of a module that leave it as it is."""
    with daemons(tmp_path_factory) as start:
        yield start()
