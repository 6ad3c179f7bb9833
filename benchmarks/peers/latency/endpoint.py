"""One end, as a process of its own: `python -m benchmarks.peers.latency.endpoint`.

It reads a Job (one line of JSON), prints "ready", reads the start time (monotonic s), and at the
end prints the stamps of everything it heard, as JSON. It does not interpret the stamps.
"""

import gc
import json
import random
import signal
import sys
import time

from benchmarks.peers.latency.job import (
    ANSWERED,
    ASKED,
    FIRST_TOPIC,
    REPLY,
    REQUEST,
    STAMP,
    Job,
    Transport,
)
from benchmarks.peers.latency.schedule import schedule
from benchmarks.peers.latency.transports import open_transport

DRAIN_S = 0.3
"""Time after the last message, for messages still in flight."""
SPARE_S = 60.0
"""Time after its end at which even a hanging process exits."""


class Endpoint:
    """Sends by the schedule, answers time requests, and stamps what arrives."""

    def __init__(self, job: Job, transport: Transport) -> None:
        self._job, self._transport, self._clock = job, transport, job.clock
        filler = bytearray(random.Random(job.seed).randbytes(job.size - STAMP.size))
        filler[-1:] = b"\xff"  # MAVLink 2 leaves trailing zeros out
        self._filler = bytes(filler)
        self.heard: list[tuple[int, int, float, float]] = []
        """Topic, number, created (s, the sender's clock), arrived (s, ours)."""
        self.exchanges: list[tuple[int, int, int, int]] = []
        """t1 to t4 in ns: sent by us, heard there, sent there, heard by us."""

    def play(self, start: float) -> None:
        """Play the whole schedule; `start` in monotonic s."""
        for after, kind, number in schedule(self._job):
            self._listen(start + after)
            if kind == REQUEST:
                self._transport.send(REQUEST, ASKED.pack(self._clock.now_ns()))
            else:
                stamp = STAMP.pack(self._clock.now(), number)
                self._transport.send(kind, stamp + self._filler)
        self._listen(start + self._job.warmup_s + self._job.seconds + DRAIN_S)

    def _listen(self, until: float) -> None:
        """Listen until that time; if it has passed, only to what is waiting."""
        left = until - time.monotonic()
        while True:
            for kind, payload in self._transport.receive(max(0.0, left)):
                self._hear(kind, payload)
            if (left := until - time.monotonic()) <= 0:
                return

    def _hear(self, kind: int, payload: bytes) -> None:
        if kind >= FIRST_TOPIC:
            arrived = self._clock.now()
            created, number = STAMP.unpack_from(payload)
            self.heard.append((kind, number, created, arrived))
            return
        now_ns = self._clock.now_ns()
        if kind == REQUEST:
            (t1,) = ASKED.unpack(payload)
            self._transport.send(REPLY, ANSWERED.pack(t1, now_ns, self._clock.now_ns()))
        else:
            self.exchanges.append((*ANSWERED.unpack(payload), now_ns))


def main() -> dict[str, object]:
    """Run the endpoint; returns its report."""
    job = Job.from_json(sys.stdin.readline())
    signal.alarm(int(job.warmup_s + job.seconds + SPARE_S))
    endpoint = Endpoint(job, open_transport(job.address, job.side, job.size))
    print("ready", flush=True)
    start = float(sys.stdin.readline())
    gc.collect()
    gc.freeze()
    gc.disable()
    endpoint.play(start)
    return {"heard": endpoint.heard, "exchanges": endpoint.exchanges}


if __name__ == "__main__":
    print(json.dumps(main()), flush=True)
