"""The rig of these benchmarks: a daemon without a modem, and programs where rclpy is."""

import json
import os
import select
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.absent import PeerError
from benchmarks.daemons import daemon_at_work
from benchmarks.environments import ROOT, interpreter, variables

ANSWER_S = 120.0
CONFIG = '[bus]\nruntime_dir = "{folder}"\n'
DOMAINS = 100


class Program:
    """A program with rclpy, which says in lines of JSON how far it is."""

    def __init__(self, module: str, *arguments: object) -> None:
        self._process = subprocess.Popen(
            [interpreter("ros"), "-m", module, *map(str, arguments)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            env=environment(),
        )  # fmt: skip

    @property
    def pid(self) -> int:
        """The id of its process."""
        return self._process.pid

    def told(self) -> Any:  # noqa: ANN401
        """The next line that it prints. Raises PeerError if none comes."""
        out = self._process.stdout
        if out is None or not select.select([out], [], [], ANSWER_S)[0]:
            raise PeerError("a ROS program does not answer")
        line = out.readline()
        if not line:
            raise PeerError("a ROS program has ended")
        return json.loads(line)

    def go(self) -> None:
        """Let it go on."""
        if self._process.stdin is not None:
            self._process.stdin.write("\n")
            self._process.stdin.flush()

    def end(self) -> None:
        """Stop it."""
        self._process.kill()
        self._process.communicate()


def environment() -> dict[str, str]:
    """The environment of a ROS program on this host alone, in a domain of this benchmark's own."""
    return {
        **variables(),
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "ros/sdrlink_ros")]),
        "ROS_DOMAIN_ID": str(1 + os.getpid() % DOMAINS),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }


@contextmanager
def daemon() -> Iterator[Path]:
    """A daemon that hears itself, without a modem; its runtime directory."""
    with TemporaryDirectory(prefix="benchmark-") as folder:
        config = Path(folder) / "sdrlinkd.toml"
        config.write_text(CONFIG.format(folder=folder))
        with daemon_at_work(config) as directory:
            yield directory


@contextmanager
def programs() -> Iterator[Any]:
    """Starts programs, and stops them at the end."""
    with ExitStack() as stack:

        def start(module: str, *arguments: object) -> Program:
            program = Program(module, *arguments)
            stack.callback(program.end)
            return program

        yield start
