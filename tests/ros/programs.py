"""ROS programs as separate processes: agents that tests drive, and bridges."""

import json
import os
import socket
from pathlib import Path
from random import Random
from typing import Any

from benchmarks.environments import ROOT
from sdrlinkd.process import Process
from tests.ros.wheels import environment, python
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
        command = [python(), ROOT / "tests/ros/agent.py", name]
        self._process = Process(command, name=name, environment=environment(domain))
        self._process.start()

    def __getattr__(self, verb: str) -> Any:
        def ask(**arguments: Any) -> Any:
            self._process.tell(json.dumps([verb, arguments]))
            answer = json.loads(self._process.line(ANSWER_S))
            assert "error" not in answer, answer
            return answer["ok"]

        return ask

    def end(self) -> None:
        """Stop the process."""
        self._process.kill()


class Bridge(Process):
    """A process of the bridge, for the daemon whose sockets are in `directory`."""

    def __init__(self, domain: int, directory: Path, *arguments: str) -> None:
        command = [python(), "-m", "sdrlink_ros", "--runtime-dir", directory]
        log = directory / f"bridge{len(list(directory.glob('bridge*.log')))}.log"
        super().__init__(
            [*command, "--ros-args", *arguments], name="bridge", log=log,
            environment=environment(domain, PYTHONUNBUFFERED=1),
        )  # fmt: skip
        self.start()

    def says(self, text: str, timeout_s: float = 60.0) -> None:
        """Wait until the log has `text`."""
        wait_for(lambda: text in self.log() or not self.is_running, timeout_s)
        assert text in self.log(), self.log()

    def end(self) -> None:
        """Stop it; it must end well, without a traceback."""
        code = self.stop()
        assert "Traceback" not in self.log(), self.log()
        assert code in (0, 2, -9), self.log()
