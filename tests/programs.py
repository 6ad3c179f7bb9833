"""Our programs as separate processes, as tests start them."""

import contextlib
import sys
from pathlib import Path
from typing import Any

import msgspec

from sdrlinkd.client import ControlClient, NoDaemonError
from sdrlinkd.process import Process, module
from sdrlinkd.reports import Snapshot
from tests.copied import origin
from tests.waiting import wait_for

MAIN = "import sys; from sdrlinkd.__main__ import main; sys.exit(main(sys.argv[1:]))"


def sdrlinkctl(*arguments: object, **more: Any) -> Process:
    """A command that is not started yet; `more` as for a Process."""
    command = module("sdrlinkd.cli", *arguments)
    return Process(command, name=f"sdrlinkctl {arguments[0]}", popen=origin.popen, **more)


def sdrlinkd(*arguments: object, **more: Any) -> Process:
    """A daemon that is not started yet; `more` as for a Process."""
    return Process(module("sdrlinkd", *arguments), name="sdrlinkd", popen=origin.popen, **more)


class Daemon(Process):
    """A daemon with the configuration `config` and its sockets in `directory`.

    `before` is Python code that it runs first.
    """

    def __init__(self, directory: Path, config: Path, log: Path, before: str = "") -> None:
        started = ["-c", before + MAIN] if before else ["-m", "sdrlinkd"]
        command = [sys.executable, *started, "--config", config]
        super().__init__(command, name="sdrlinkd", log=log, popen=None if before else origin.popen)
        self.directory = directory
        self.config = config
        self.expected_exit = 0

    def control(self) -> ControlClient:
        """A connection to its control socket."""
        return ControlClient(self.directory)

    def snapshot(self) -> Snapshot:
        """The daemon's current snapshot."""
        with self.control() as control:
            return msgspec.convert(control.ask("status"), Snapshot)

    def is_up(self) -> bool:
        """Whether the daemon answers."""
        assert self.is_running, self.log()
        with contextlib.suppress(NoDaemonError), ControlClient(self.directory, 0.2) as control:
            control.ask("hello")
            return True
        return False

    def at_work(self) -> "Daemon":
        """Start the daemon, and return it once it answers."""
        self.start()
        wait_for(self.is_up)
        return self

    def ends_well(self, within_s: float = 10.0) -> None:
        """Stop the daemon; it must end as expected, without a traceback."""
        code = self.stop(within_s=within_s)
        assert "Traceback" not in self.log(), self.log()
        assert code == self.expected_exit, self.log()
