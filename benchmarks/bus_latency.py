"""Latency of a message from a producer through one daemon to a consumer."""

import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import zmq

from benchmarks.daemons import daemon_at_work
from benchmarks.report import Row
from sdrlinkd.client import Publisher, Subscriber

PAYLOAD = b"\0\1\0\0" + bytes(720)
PERIOD_S = 0.004


def latency_row(messages: int) -> Row:
    """Wall time, as a user would notice it: three processes share this machine's cores."""
    ours = _through_daemon(messages)
    floor = _through_forwarder(messages)
    return Row(
        "path_latency_ms_p50", float(np.median(ours)), "ms", 2.0, "less", messages,
        peers={"bare_zmq_forwarder_p50": float(np.median(floor)),
               "ours_p99": float(np.quantile(ours, 0.99)),
               "bare_zmq_forwarder_p99": float(np.quantile(floor, 0.99))},
        note="724 B every 4 ms, one 1024 B PDU each, direct link",
    )  # fmt: skip


def _through_daemon(messages: int) -> list[float]:
    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder)
        (directory / "registry.csv").write_text("odom,nav_msgs/Odometry\n")
        config = directory / "sdrlinkd.toml"
        config.write_text(f'[bus]\nruntime_dir = "{folder}"\n')
        with (
            daemon_at_work(config) as runtime_dir,
            Subscriber("/rx_robot_1/odom", runtime_dir=runtime_dir) as subscriber,
            Publisher(runtime_dir) as publisher,
        ):
            return _paced(
                messages,
                lambda: publisher.send("/robot_1/odom", PAYLOAD),
                lambda: subscriber.receive(5) is not None,
            )


def _through_forwarder(messages: int) -> list[float]:
    """PUSH → a thread that receives and sends on → SUB: ZeroMQ's own share."""
    context = zmq.Context()
    with tempfile.TemporaryDirectory() as folder:
        pull, pub = context.socket(zmq.PULL), context.socket(zmq.PUB)
        push, sub = context.socket(zmq.PUSH), context.socket(zmq.SUB)
        pull.bind(f"ipc://{folder}/in")
        pub.bind(f"ipc://{folder}/out")
        push.connect(f"ipc://{folder}/in")
        sub.connect(f"ipc://{folder}/out")
        sub.subscribe(b"")

        def forward() -> None:
            while frames := pull.recv_multipart():
                if frames == [b"stop"]:
                    return
                pub.send_multipart(frames)

        thread = threading.Thread(target=forward)
        thread.start()
        # Messages published before the subscription is known are dropped.
        push.send_multipart([b"hello"])
        while not sub.poll(10):
            push.send_multipart([b"hello"])
        while sub.poll(50):
            sub.recv_multipart()
        latencies = _paced(
            messages,
            lambda: push.send_multipart([b"/odom\0", b"\1\x80", PAYLOAD]),
            lambda: bool(sub.recv_multipart()),
        )
        push.send_multipart([b"stop"])
        thread.join()
        context.destroy()
    return latencies


def _paced(messages: int, send: Callable[[], object], receive: Callable[[], bool]) -> list[float]:
    latencies = []
    due = time.monotonic()
    for _ in range(messages):
        due += PERIOD_S
        time.sleep(max(0.0, due - time.monotonic()))
        began = time.perf_counter()
        send()
        if not receive():
            raise RuntimeError("a message did not arrive")
        latencies.append((time.perf_counter() - began) * 1e3)
    return latencies
