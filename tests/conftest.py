"""Fixtures that more than one folder uses: real daemons."""

import contextlib
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec
import pytest

from sdrlinkd.client import ControlClient, NoDaemonError
from sdrlinkd.link import Lives
from sdrlinkd.reports import Snapshot
from tests.tiers import (
    pytest_collection_modifyitems,
    pytest_configure,
    pytest_terminal_summary,
)
from tests.waiting import wait_for

__all__ = ["pytest_collection_modifyitems", "pytest_configure", "pytest_terminal_summary"]

MAIN = "import sys; from sdrlinkd.__main__ import main; sys.exit(main(sys.argv[1:]))"
ETC = Path(__file__).parents[1] / "etc"
# A daemon would count it, and tell it with its ledger.
Lives.is_strict = True


@dataclass
class Running:
    """A daemon of its own process."""

    process: subprocess.Popen[bytes]
    directory: Path
    config: Path
    log_path: Path
    expected_exit: int = 0

    def control(self) -> ControlClient:
        """A connection to its control socket."""
        return ControlClient(self.directory)

    def snapshot(self) -> Snapshot:
        """Its snapshot."""
        with self.control() as control:
            return msgspec.convert(control.ask("status"), Snapshot)

    def log(self) -> str:
        """What it has logged."""
        return self.log_path.read_text()

    def is_up(self) -> bool:
        """Whether it answers."""
        assert self.process.poll() is None, self.log()
        with contextlib.suppress(NoDaemonError), ControlClient(self.directory, 0.2) as control:
            control.ask("hello")
            return True
        return False


@pytest.fixture(autouse=True)
def _no_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tables are as wide as where nobody says how wide; whoever runs the tests may say it."""
    monkeypatch.delenv("COLUMNS", raising=False)


@pytest.fixture
def write_config() -> Callable[..., Path]:
    """Writes a configuration whose sockets are in the given folder; further TOML may follow."""

    def write(directory: Path, extra_toml: str = "") -> Path:
        top, tables = [], extra_toml
        while tables and not tables.startswith("["):
            line, _, tables = tables.partition("\n")
            top.append(line)
        if not any(line.startswith("registry") for line in top):
            top.append(f'registry = "{ETC / "registry.csv"}"')
        config = directory / "sdrlinkd.toml"
        config.write_text(
            "\n".join([*top, "seed = 1", "[bus]", f'runtime_dir = "{directory}"', tables])
        )
        return config

    return write


@pytest.fixture
def start_daemon(
    tmp_path_factory: pytest.TempPathFactory, write_config: Callable[..., Path]
) -> Iterator[Callable[..., Running]]:
    """Starts daemons and stops them in order; each must end well, without a traceback."""
    started: list[Running] = []

    def start(extra_toml: str = "", before: str = "") -> Running:
        """`before`: Python that the daemon runs first."""
        directory = tmp_path_factory.mktemp("node")
        config = write_config(directory, extra_toml)
        log_path = directory / "log"
        with log_path.open("wb") as log:
            process = subprocess.Popen(
                [sys.executable, "-c", before + MAIN, "--config", str(config)],
                stdout=log,
                stderr=log,
            )
        running = Running(process, directory, config, log_path)
        started.append(running)
        wait_for(running.is_up)
        return running

    yield start
    for running in started:
        running.process.terminate()
        try:
            code = running.process.wait(10)
        except subprocess.TimeoutExpired:
            running.process.kill()
            code = running.process.wait()
        assert "Traceback" not in running.log(), running.log()
        assert code == running.expected_exit, running.log()
