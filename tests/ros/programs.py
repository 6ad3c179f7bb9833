"""ROS programs as separate processes: agents that tests drive, and bridges."""

import json
import os
import select
import socket
import subprocess
from pathlib import Path
from random import Random
from typing import Any

from benchmarks.environments import ROOT
from tests.ros.wheels import in_domain, python
from tests.waiting import wait_for

ANSWER_S = 60.0
_domains = iter(Random(os.getpid()).sample(range(1, 101), 100))
_taken: list[socket.socket] = []


def new_domain() -> int:
    """A ROS domain that no test on this host uses, in this process or another."""
    for domain in _domains:
        lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            # An abstract socket is free again when this process ends.
            lock.bind(f"\0sdrlinkd-test-domain-{domain}")
        except OSError:
            lock.close()
            continue
        _taken.append(lock)
        return domain
    raise AssertionError("all ROS domains are in use")


class Agent:
    """A process of `agent.py`; its methods are those of the agent."""

    def __init__(self, domain: int, name: str) -> None:
        self._process = subprocess.Popen(
            [python(), ROOT / "tests/ros/agent.py", name],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=in_domain(domain),
        )  # fmt: skip

    def __getattr__(self, verb: str) -> Any:
        def ask(**arguments: Any) -> Any:
            stdin, stdout = self._process.stdin, self._process.stdout
            assert stdin is not None
            assert stdout is not None
            stdin.write(json.dumps([verb, arguments]) + "\n")
            stdin.flush()
            assert select.select([stdout], [], [], ANSWER_S)[0], f"no answer to {verb}"
            answer = json.loads(stdout.readline())
            assert "error" not in answer, answer
            return answer["ok"]

        return ask

    def end(self) -> None:
        """Stop the process."""
        self._process.kill()
        self._process.communicate()


class Bridge:
    """A process of the bridge, for the daemon whose sockets are in `directory`."""

    def __init__(self, domain: int, directory: Path, *arguments: str) -> None:
        self._log = directory / f"bridge{len(list(directory.glob('bridge*.log')))}.log"
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                [python(), "-m", "sdrlink_ros", "--runtime-dir", directory, "--ros-args",
                 *arguments],
                stdout=log, stderr=subprocess.STDOUT, env=in_domain(domain, PYTHONUNBUFFERED=1),
            )  # fmt: skip

    def log(self) -> str:
        """What it has said so far."""
        return self._log.read_text()

    def says(self, text: str, timeout_s: float = 60.0) -> None:
        """Wait until the log has `text`."""
        wait_for(lambda: text in self.log() or not self.is_running, timeout_s)
        assert text in self.log(), self.log()

    @property
    def is_running(self) -> bool:
        """Whether the process has not ended."""
        return self.process.poll() is None

    def kill(self) -> None:
        """End it as a crash would."""
        self.process.kill()
        self.process.wait()

    def end(self) -> None:
        """Stop it; it must end well, without a traceback."""
        if self.is_running:
            self.process.terminate()
        code = self.process.wait(20)
        assert "Traceback" not in self.log(), self.log()
        assert code in (0, 2, -9), self.log()
