"""Number of messages that a CPU second moves from a producer's socket into the queue."""

import asyncio
import multiprocessing
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from random import Random

import uvloop
import zmq
import zmq.asyncio

from benchmarks.report import Row
from sdrlinkd.bus import Bus, RuntimeDirectory
from sdrlinkd.config import make_setup, parse_config
from sdrlinkd.link import AS_CONFIGURED, Link, Overrides

PAYLOAD_BYTES = 700

# (folder, messages, start the producer) → CPU seconds of this process
Receive = Callable[[Path, int, Callable[[], None]], float]


class _Counted:
    """An ingress that really queues, and knows when all messages are in."""

    def __init__(self, link: Link, expected: int) -> None:
        self._link = link
        self._expected = expected
        self.count = 0
        self.done = asyncio.Event()

    def submit(
        self,
        topic_id: int,
        payload: bytes,
        overrides: Overrides = AS_CONFIGURED,
        published_ns: int | None = None,  # noqa: ARG002  # producers here do not say
    ) -> None:
        """Queue a message, and count it."""
        self._link.submit(topic_id, payload, time.monotonic(), overrides)
        self.count += 1
        if self.count == self._expected:
            self.done.set()

    def refuse(
        self, reason: str, topic_id: int | None = None, receipt: str = "", dst: int | None = None
    ) -> None:
        """Fail: no message of this benchmark may be refused."""
        raise RuntimeError(f"topic {topic_id}: {reason} {receipt} {dst}")


def ingress_row(messages: int, runs: int) -> Row:
    """Median over `runs`; the floor is a blocking loop that only receives."""
    ours = statistics.median(_run(messages, _through_bus) for _ in range(runs))
    peers = {
        "blocking_receive_only": statistics.median(_run(messages, _blocking) for _ in range(3)),
        "zmq_asyncio_receive_only": _run(messages // 2, _zmq_asyncio),
    }
    return Row(
        "ingress_msgs_per_cpu_s_700B", ours, "1/s", 80_000, "more", runs, peers,
        note="CPU time of the whole receiving process, one saturating producer",
    )  # fmt: skip


def _run(messages: int, receive: Receive) -> float:
    """Messages per CPU second of this process while another one sends."""
    with tempfile.TemporaryDirectory() as folder:
        producer = multiprocessing.get_context("spawn").Process(
            target=_produce, args=(folder, messages)
        )
        cpu_s = receive(Path(folder), messages, producer.start)
        producer.join()
    return messages / cpu_s


def _produce(folder: str, messages: int) -> None:
    """A bare producer, which serves the peers as well; it stays for a while."""
    context = zmq.Context()
    with context.socket(zmq.PUSH) as socket:
        socket.connect(f"ipc://{folder}/in.sock")
        frames = [b"/robot_1/odom\0", b"\1\x80", b"\0\1\0\0" + bytes(PAYLOAD_BYTES - 4)]
        for _ in range(messages):
            socket.send_multipart(frames)
        # libzmq may drop the end of a burst when its sender exits at once.
        time.sleep(1.0)
    context.term()


def _through_bus(folder: Path, messages: int, start: Callable[[], None]) -> float:
    (folder / "registry.csv").write_text("odom,nav_msgs/Odometry\n")
    setup = make_setup(
        parse_config("[queue]\nmax_messages = 1000000\nmax_bytes = 1000000000"), folder
    )
    config = setup.config
    link = Link(config.link, config.queue, config.reassembly, setup.registry, 1, Random(1))

    async def receive() -> float:
        directory = RuntimeDirectory(folder)
        context = zmq.Context()
        counted = _Counted(link, messages)
        bus = Bus(context, directory, setup, counted)
        start()
        began = time.process_time()
        await counted.done.wait()
        cpu_s = time.process_time() - began
        bus.close()
        context.destroy()
        directory.close()
        return cpu_s

    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        return runner.run(receive())


def _blocking(folder: Path, messages: int, start: Callable[[], None]) -> float:
    context = zmq.Context()
    with context.socket(zmq.PULL) as socket:
        socket.bind(f"ipc://{folder}/in.sock")
        start()
        began = time.process_time()
        for _ in range(messages):
            socket.recv_multipart()
        cpu_s = time.process_time() - began
    context.term()
    return cpu_s


def _zmq_asyncio(folder: Path, messages: int, start: Callable[[], None]) -> float:
    async def receive() -> float:
        context = zmq.asyncio.Context()
        with context.socket(zmq.PULL) as socket:
            socket.bind(f"ipc://{folder}/in.sock")
            start()
            began = time.process_time()
            for _ in range(messages):
                await socket.recv_multipart()
            cpu_s = time.process_time() - began
        context.term()
        return cpu_s

    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        return runner.run(receive())
