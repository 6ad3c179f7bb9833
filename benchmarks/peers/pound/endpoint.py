"""One end of an experiment, as a process of its own: `python -m benchmarks.peers.pound.endpoint`.

It reads a Job (one line of JSON), connects with the other end, prints "ready", reads the start time
(monotonic s; both ends share the machine's clock), and at the end prints what it heard, as JSON.
"""

import gc
import json
import math
import os
import signal
import struct
import sys
import time
from collections import deque

from benchmarks.peers.pound.job import CONTACT_S, Job, Loop, NoContactError, Transport
from benchmarks.peers.pound.sockets import Sockets
from benchmarks.peers.pound.table import PEERS
from benchmarks.peers.pound.wire import HEAD

VALUE = struct.Struct("<d")
Y, U = 0, 1
NICE = -10
"""High priority, so that other programs on this machine cause no jitter."""


class Player:
    """Sends by a schedule, and records when messages arrive."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._filler = {topic.number: os.urandom(topic.size) for topic in job.out}
        self.heard: dict[int, dict[int, float]] = {topic.number: {} for topic in job.into}
        self.values: list[float] = []
        self.start = math.inf

    def hear(self, message: bytes, at: float) -> None:
        """Record a message with its arrival time in s after the start."""
        topic, number = HEAD.unpack_from(message)
        self.heard[topic].setdefault(number, at - self.start)

    def play(self, transport: Transport) -> None:
        """Play the schedule, then wait until the end."""
        end = self.start + self._job.seconds
        for after, topic, number in self._job.sends:
            transport.run(min(self.start + after, end))
            if time.monotonic() > end:
                return
            self.send(transport, topic, number)
        transport.run(end)

    def send(self, transport: Transport, topic: int, number: int, value: float = 0.0) -> None:
        """Send one message with these numbers, padded with random bytes."""
        head = HEAD.pack(topic, number) + VALUE.pack(value)
        transport.send(topic, head + self._filler[topic][len(head) :])


class Plant(Player):
    """Sends its output once per period; steps at each tick with the input received by then."""

    def __init__(self, job: Job, loop: Loop) -> None:
        super().__init__(job)
        self._loop, self._u = loop, 0.0

    def hear(self, message: bytes, at: float) -> None:
        """Store an input; other messages only load the channel."""
        super().hear(message, at)
        if HEAD.unpack_from(message)[0] == U:
            (self._u,) = VALUE.unpack_from(message, HEAD.size)

    def play(self, transport: Transport) -> None:
        """Step through all ticks of the loop."""
        (a00, a01), (a10, a11) = self._loop.a
        b0, b1 = self._loop.b
        x0 = x1 = 0.0
        sends = deque(self._job.sends)
        for tick in range(self._loop.ticks):
            at = self.start + tick * self._loop.tick_s
            while sends and self.start + sends[0][0] <= at:
                after, *rest = sends.popleft()
                transport.run(self.start + after)
                self.send(transport, *rest)
            transport.run(at)
            self.values.append(x0)
            if tick % self._loop.every == 0:
                self.send(transport, Y, tick // self._loop.every, x0)
            u = self._u
            x0, x1 = a00 * x0 + a01 * x1 + b0 * u, a10 * x0 + a11 * x1 + b1 * u


class Controller(Player):
    """Answers each output with an input, and plays its schedule at the same time."""

    def __init__(self, job: Job, loop: Loop) -> None:
        super().__init__(job)
        self._loop = loop
        self.transport: Transport | None = None

    def hear(self, message: bytes, at: float) -> None:
        """Answer an output y with u = gain (setpoint - y)."""
        super().hear(message, at)
        topic, number = HEAD.unpack_from(message)
        if topic == Y and self.transport:
            (y,) = VALUE.unpack_from(message, HEAD.size)
            self.send(self.transport, U, number, self._loop.gain * (self._loop.setpoint - y))


def part(job: Job) -> Player:
    """The player for this end's task."""
    if job.loop is None:
        return Player(job)
    return Plant(job, job.loop) if job.side == "a" else Controller(job, job.loop)


def open_transport(job: Job, player: Player) -> Transport:
    """This end of the peer."""
    peer = PEERS[job.peer]
    if peer.environment == "zenoh":
        from benchmarks.peers.pound.zenoh_end import Zenoh

        return Zenoh(job, peer.transports["default"], player.hear)
    if peer.environment == "ros":
        from benchmarks.peers.pound.fastdds_end import FastDds

        return FastDds(job, peer.transports["default"], player.hear)
    return Sockets(job, peer.transports, player.hear)


def main() -> dict[str, object]:
    """Run the endpoint; returns its report."""
    job = Job.from_json(sys.stdin.readline())
    os.nice(NICE)
    # Even a hanging process ends in time.
    signal.alarm(int(2 * CONTACT_S + job.seconds + 20))
    player = part(job)
    try:
        transport = open_transport(job, player)
        if isinstance(player, Controller):
            player.transport = transport
        transport.meet()
    except (NoContactError, OSError) as error:
        return {"error": str(error)}
    print("ready", flush=True)
    player.start = float(sys.stdin.readline())
    gc.collect()
    gc.freeze()
    gc.disable()
    player.play(transport)
    heard = {topic: list(times.items()) for topic, times in player.heard.items()}
    transport.close()
    return {"heard": heard, "values": player.values}


if __name__ == "__main__":
    print(json.dumps(main()), flush=True)
    # Skip the interpreter's shutdown, which middleware threads would delay.
    os._exit(0)
