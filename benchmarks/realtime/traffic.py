"""Sends flows of messages through daemons on a schedule, and records when they arrive.

A message begins with a std_msgs/Header's stamp, which is the time at which its producer sent it.
Producer and consumer run on this host, on threads with a short slice.
"""

import gc
import struct
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.absent import PeerError
from benchmarks.flows import Flow, Times
from benchmarks.realtime.slice import take_short_slice
from sdrlinkd.client import Publisher, Subscriber

CDR = b"\0\1\0\0"
STAMP = struct.Struct("<iI")
AT = slice(len(CDR), len(CDR) + STAMP.size)
"""Position of the stamp in a message."""
WARM_UP_S = 0.5
"""Messages of this time at the start are sent and not counted."""
LEAD_S = 0.1
"""Time from when all threads are ready to the first message."""
DRAIN_S = 2.0
"""Longest wait for messages after the last one was sent."""
LOOK_S = 0.05
READY_S = 20.0
SWITCH_S = 1e-4
"""Time for which a thread of this process keeps the interpreter while the other one waits."""


@dataclass
class Record:
    """The counted messages of one flow: times in ns since 1970, by stamp."""

    sent: dict[bytes, int] = field(default_factory=dict)
    heard: dict[bytes, int] = field(default_factory=dict)
    published: dict[bytes, int] = field(default_factory=dict)
    """When the message was published by the receiving daemon's account, where that is known."""

    @property
    def is_complete(self) -> bool:
        """Whether all counted messages have arrived."""
        return self.sent.keys() <= self.heard.keys()

    @property
    def lost(self) -> int:
        """The number of counted messages that have not arrived."""
        return len(self.sent.keys() - self.heard.keys())

    def late_ms(self) -> Times:
        """The latency of each counted message in ms; infinite for a message that is lost."""
        lost_at = float("inf")
        return np.array([1e-6 * (self.heard.get(each, lost_at) - at)
                         for each, at in self.sent.items()])  # fmt: skip

    def age_errors_us(self) -> Times:
        """By how much the told age was too small, in µs, for each message whose age is known."""
        known = self.published.keys() & self.sent.keys()
        return np.array([1e-3 * (self.published[each] - self.sent[each]) for each in known])


def flow(name: str, size: int, period_s: float, seconds: float) -> Flow:
    """A flow of messages of `size` bytes whose counted part lasts for `seconds`."""
    return Flow(name, size, period_s, int((WARM_UP_S + seconds) / period_s))


def play(
    sends: Path, hears: Path, flows: Sequence[Flow], seed: int, *, dated: bool = False
) -> dict[str, Record]:
    """Publish flows at robot 1 in the folder `sends`, and listen in `hears`; records by flow.

    With `dated`, the producer says when each message was published. Raises PeerError if nothing
    arrives.
    """
    records = {each.name: Record() for each in flows}
    ready, ended = threading.Event(), threading.Event()
    with undisturbed(), ThreadPoolExecutor(2) as pool:
        ear = pool.submit(_listen, hears, records, ready, ended)
        try:
            ready.wait(READY_S)
            pool.submit(_produce, sends, flows, records, seed, dated).result()
            deadline = time.monotonic() + DRAIN_S
            while time.monotonic() < deadline and not _are_complete(records):
                time.sleep(LOOK_S)
        finally:
            ended.set()
        ear.result()
    for name, record in records.items():
        if not record.sent.keys() & record.heard.keys():
            raise PeerError(f"no message of {name} arrived")
    return records


@contextmanager
def undisturbed() -> Iterator[None]:
    """Keep the garbage collector away, and let the threads of this process alternate quickly."""
    interval_s = sys.getswitchinterval()
    gc.collect()
    gc.disable()
    sys.setswitchinterval(SWITCH_S)
    try:
        yield
    finally:
        sys.setswitchinterval(interval_s)
        gc.enable()


def stamp(now_ns: int) -> bytes:
    """A time in ns since 1970 as it stands in a message."""
    return STAMP.pack(*divmod(now_ns, 10**9))


def _are_complete(records: dict[str, Record]) -> bool:
    return all(record.is_complete for record in records.values())


def _produce(
    folder: Path, flows: Sequence[Flow], records: dict[str, Record], seed: int, dated: bool
) -> None:
    take_short_slice()
    rng = np.random.default_rng(seed)
    phases = {each.name: rng.uniform(0, each.period_s) for each in flows}
    due = sorted(
        (float(at) + phases[each.name], each.name) for each in flows for at in each.times(rng)
    )
    rest = {each.name: rng.bytes(each.size - AT.stop) for each in flows}
    with Publisher(folder) as out:
        out.wait_for_daemon()
        begin = time.monotonic() + LEAD_S
        for at, name in due:
            time.sleep(max(0.0, begin + at - time.monotonic()))
            now_ns = time.time_ns()
            head = stamp(now_ns)
            if at >= WARM_UP_S:
                records[name].sent[head] = now_ns
            out.send(
                f"/robot_1/{name}", CDR + head + rest[name],
                published_ns=now_ns if dated else None,
            )  # fmt: skip


def _listen(
    folder: Path, records: dict[str, Record], ready: threading.Event, ended: threading.Event
) -> None:
    take_short_slice()
    topics = [f"/rx_robot_1/{name}" for name in records]
    with Subscriber(*topics, runtime_dir=folder, depth=0) as ear:
        ready.set()
        while not ended.is_set():
            message = ear.receive(LOOK_S)
            if message is not None:
                now_ns = time.time_ns()
                record, head = records[message.topic.rpartition("/")[2]], message.payload[AT]
                record.heard[head] = now_ns
                if message.published_ns is not None:
                    record.published[head] = message.published_ns
