"""Starts both ends of a peer, one in each namespace, and collects what they heard."""

import json
import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import IO, NamedTuple

from benchmarks.environments import interpreter, variables
from benchmarks.peers.pound.job import Job, Loop, Topic
from benchmarks.peers.pound.namespaces import Network, Node
from benchmarks.peers.pound.table import PEERS, unavailable

START_S = 0.3
"""From both ends being ready to the beginning of the experiment."""


class PeerError(Exception):
    """A peer could not be measured; the message names it and the reason."""


class Told(NamedTuple):
    """What one end tells."""

    heard: dict[int, dict[int, float]]
    """Of each topic's messages that came, by number: s after the start."""
    values: list[float]
    """The plant's output at each tick."""


class Plan(NamedTuple):
    """What a pair of ends is to do; see `Job`."""

    topics: list[Topic]
    sends: dict[str, list[tuple[float, int, int]]]
    """Each side's schedule."""
    seconds: float
    loop: Loop | None = None


def run_ends(
    peer: str, plan: Plan, network: Network, during: Callable[[float], None] | None = None
) -> dict[str, Told]:
    """What sides "a" and "b" tell. `during` is called with the start, in monotonic s."""
    if (reason := unavailable(peer)) is not None:
        raise PeerError(f"{peer}: {reason}")
    with ExitStack() as stack:
        ends = {}
        for side, here, there in (("a", network.a, network.b), ("b", network.b, network.a)):
            job = Job(
                peer,
                side,
                here.address,
                there.address,
                network.rate_bps / network.hops,
                plan.topics,
                plan.sends.get(side, []),
                plan.seconds,
                plan.loop,
            )
            errors = stack.enter_context(tempfile.TemporaryFile())
            ends[side] = _End(job, here, errors)
            stack.callback(ends[side].end)
            ends[side].tell(job.to_json() + "\n")
        for end in ends.values():
            end.expect_ready()
        start = time.monotonic() + START_S
        for end in ends.values():
            end.tell(f"{start!r}\n")
        if during:
            during(start)
        return {side: end.told() for side, end in ends.items()}


class _End:
    """One process. It ends by itself in bounded time, and at the latest with the stack."""

    def __init__(self, job: Job, node: Node, errors: IO[bytes]) -> None:
        self._name = f"{job.peer}, end {job.side}"
        self._errors = errors
        environment = PEERS[job.peer].environment
        program = [interpreter(environment), "-m", "benchmarks.peers.pound.endpoint"]
        self._process = subprocess.Popen(
            node.command(*program),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env=variables(),
        )

    def tell(self, line: str) -> None:
        """Write to it."""
        assert self._process.stdin
        try:
            self._process.stdin.write(line)
            self._process.stdin.flush()
        except BrokenPipeError:
            raise PeerError(f"{self._name}: {self._last_words()}") from None

    def expect_ready(self) -> None:
        """Wait for it to have met the other end."""
        line = self._line()
        if line != "ready":
            raise PeerError(f"{self._name}: {json.loads(line)['error']}")

    def told(self) -> Told:
        """Wait for its end."""
        told = json.loads(self._line())
        heard = {int(topic): dict(pairs) for topic, pairs in told["heard"].items()}
        return Told(heard, told["values"])

    def _line(self) -> str:
        assert self._process.stdout
        line = self._process.stdout.readline().strip()
        if not line:
            raise PeerError(f"{self._name}: {self._last_words()}")
        return line

    def _last_words(self) -> str:
        status = self._process.wait()
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else f"ended without a word, status {status}"

    def end(self) -> None:
        """Whatever it is doing."""
        self._process.kill()
        self._process.communicate()
