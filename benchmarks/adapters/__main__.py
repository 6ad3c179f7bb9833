"""The ROS 2 bridge: processor time a message, what it adds to latency, and what it costs idle."""

import json
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.absent import PeerError, attempt
from benchmarks.adapters.rig import daemon, programs
from benchmarks.processes import family_memory_mb, usage
from benchmarks.report import Row, main
from sdrlinkd.client import ControlClient, Publisher, Subscriber
from sdrlinkd.process import Process

BRIDGE = "sdrlink_ros"
PLAIN = "benchmarks.peers.ros.plain"
NODE = "benchmarks.peers.ros.node"
TOPIC, TYPE, HEARD = "/odom", "nav_msgs/msg/Odometry", "/rx_robot_1/odom"
ODOMETRY = b"\0\1\0\0" + bytes(720)
HZ = 1000
QUIET_S = 2.0
WAIT_S = 60.0


class Cost(NamedTuple):
    """Processor time of a bridge for one message in µs, and messages lost."""

    us: float
    lost: int


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure all rows; the seed changes nothing, as no chance is involved."""
    del seed
    n, runs = (1000, 1) if quick else (4000, 3)
    with attempt("rclpy_in_cpu_ratio"):
        yield _in_row(n, runs)
    with attempt("rclpy_out_us"):
        yield _out_row(n, runs)
    with attempt("rclpy_added_ms_p50"):
        yield _added_row(200 if quick else 1500)
    with attempt("rclpy_idle_cpu_pct"):
        yield from _idle_rows(5.0 if quick else 30.0)


def _in_row(n: int, runs: int) -> Row:
    ours, plain = [], []
    for _ in range(runs):
        ours.append(_cost_in(True, n))
        plain.append(_cost_in(False, n))
    own, other = (statistics.median(each.us for each in costs) for costs in (ours, plain))
    return Row(
        "rclpy_in_cpu_ratio", own / other, "", 0.8, "less", runs,
        peers={"ours_us": own, "plain_bridge_us": other,
               "ours_lost": sum(each.lost for each in ours),
               "plain_lost": sum(each.lost for each in plain)},
        note=f"724 B at {HZ} Hz from a node to the daemon; the plain bridge has 40 lines",
    )  # fmt: skip


def _cost_in(is_ours: bool, n: int) -> Cost:
    """What a bridge needs for messages from a ROS node to the daemon."""
    with daemon() as directory, programs() as start:
        bridge = _bridge(start, directory) if is_ours else start(PLAIN, directory)
        source = start(NODE, "source", HZ, n)
        source.line()
        time.sleep(QUIET_S)
        before = usage(bridge.pid).cpu_s
        source.tell("")
        source.line()
        _settled(lambda: _accepted(directory) >= n)
        used_s = usage(bridge.pid).cpu_s - before
        return Cost(1e6 * used_s / n, n - _accepted(directory))


def _out_row(n: int, runs: int) -> Row:
    costs = [_cost_out(n) for _ in range(runs)]
    return Row(
        "rclpy_out_us", statistics.median(each.us for each in costs), "µs", 300, "less", runs,
        peers={"lost": sum(each.lost for each in costs)},
        note=f"724 B at {HZ} Hz from the daemon to a node",
    )  # fmt: skip


def _cost_out(n: int) -> Cost:
    """What the bridge needs for messages from the daemon to a ROS node."""
    with daemon() as directory, programs() as start:
        bridge, sink = _bridge(start, directory), start(NODE, "sink", n)
        sink.line()
        _declare(directory)
        _settled(lambda: TOPIC in _ask(directory, "demand")["wanted"])
        with Publisher(directory) as out:
            time.sleep(QUIET_S)
            before = usage(bridge.pid).cpu_s
            begin = time.monotonic()
            for i in range(n):
                time.sleep(max(0.0, begin + i / HZ - time.monotonic()))
                out.send(TOPIC, ODOMETRY)
        sink.tell("")
        received = len(_ages(sink))
        used_s = usage(bridge.pid).cpu_s - before
        return Cost(1e6 * used_s / n, n - received)


def _added_row(n: int) -> Row:
    """What both directions of the bridge add to the daemon's own latency."""
    with daemon() as directory, programs() as start:
        _bridge(start, directory)
        sink = start(NODE, "sink", n)
        sink.line()
        source = start(NODE, "source", 100, n)
        source.line()
        time.sleep(QUIET_S)
        source.tell("")
        source.line()
        sink.tell("")
        through = sorted(_ages(sink))
    alone = _alone(n)
    if len(through) < n // 2:
        raise PeerError(f"only {len(through)} of {n} messages arrived")
    p50 = statistics.median(through)
    return Row(
        "rclpy_added_ms_p50", p50 - statistics.median(alone), "ms", 2.0, "less", n,
        peers={"through_all_p50": p50, "through_all_p99": through[int(0.99 * len(through))],
               "daemon_alone_p50": statistics.median(alone), "lost": n - len(through)},
        note="724 B at 100 Hz, node to bridge to daemon to bridge to node, less the daemon alone",
    )  # fmt: skip


def _alone(n: int) -> list[float]:
    """Latencies in ms of the daemon without a bridge."""
    ages = []
    with daemon() as directory:
        _declare(directory)
        with Subscriber(HEARD, runtime_dir=directory) as heard, Publisher(directory) as out:
            for _ in range(min(n, 300)):
                begin = time.perf_counter()
                out.send(TOPIC, ODOMETRY)
                heard.receive(5.0)
                ages.append(1e3 * (time.perf_counter() - begin))
                time.sleep(0.01)
    return ages


def _idle_rows(seconds: float) -> Iterator[Row]:
    with daemon() as directory, programs() as start:
        bridge, graph = _bridge(start, directory), start(NODE, "graph", 100)
        graph.line()
        _settled(lambda: len(_ask(directory, "declared")) >= 100)
        time.sleep(QUIET_S)
        before = usage(bridge.pid).cpu_s
        time.sleep(seconds)
        used_pct = 100 * (usage(bridge.pid).cpu_s - before) / seconds
        memory = family_memory_mb(bridge.pid)
    note = "100 topics of another node, none wanted; each seen, declared and heard"
    yield Row("rclpy_idle_cpu_pct", used_pct, "%", 3.0, "less", 1, note=note)
    yield Row(
        "rclpy_idle_mb", memory["Rss"], "MB", 120.0, "less", 1, peers={"pss": memory["Pss"]},
        note=note,
    )  # fmt: skip


def _bridge(start: Callable[..., Process], directory: Path) -> Process:
    return start(BRIDGE, "--runtime-dir", directory, "--ros-args", "-p", 'eager:=["/odom"]')


def _ages(sink: Process) -> list[float]:
    """The ages in ms of the messages that a sink received."""
    ages: list[float] = json.loads(sink.line())
    return ages


def _declare(directory: Path) -> None:
    with ControlClient(directory) as control:
        control.ask("declare", {"name": TOPIC, "type": TYPE})


def _ask(directory: Path, verb: str) -> Any:  # noqa: ANN401
    with ControlClient(directory) as control:
        return control.ask(verb)


def _accepted(directory: Path) -> int:
    return int(_ask(directory, "status")["link"]["tx"]["accepted"])


def _settled(is_so: Callable[[], bool]) -> None:
    """Wait until a condition holds, or for long enough that the rest is lost."""
    deadline = time.monotonic() + WAIT_S
    while not is_so() and time.monotonic() < deadline:
        time.sleep(0.2)


if __name__ == "__main__":
    sys.exit(main("adapters", measure))
