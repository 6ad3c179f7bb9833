"""The same with whole programs: daemons, and the hub of their air, in real time."""

import struct
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

import msgspec

from benchmarks import processes
from benchmarks.daemons import hears_one, wait_for
from benchmarks.defaults.team import CDR, Flow, listener_of, robots_of, written
from sdrlinkd.client import ControlClient, Publisher, Subscriber

QUIET = ("--log-level", "warning")
AIR = """pace = "realtime"
duration_s = 3600.0
[air]
rate_hz = 2e6
snr_db = 25.0
"""
RATE = "2 Msps"
"""What this machine keeps up with; `init` writes 5 Msps."""
REST_S = 1.0
"""Time in s after the last message, so that it may arrive."""
_NUMBER = struct.Struct("<I")

Ages = Mapping[str, Mapping[int, float]]
"""The age in s at which each message arrived, by topic and number."""


def drive_daemons(flows: Sequence[Flow], mcs: int | None, rest_s: float = REST_S) -> Ages:
    """Let the daemons of a team send all messages of `flows`, and hear them from each other.

    Raises PeerError.
    """
    robots = robots_of(flows)
    with tempfile.TemporaryDirectory(prefix="benchmark-") as name, ExitStack() as stack:
        folders = _start(stack, Path(name), mcs, robots)
        for flow in flows:
            with ControlClient(folders[flow.sender]) as control:
                control.ask("declare", msgspec.to_builtins(flow.declaration))
        due = sorted((at, i, n) for i, flow in enumerate(flows) for n, at in enumerate(flow.times))
        sent_at: dict[tuple[str, int], float] = {}
        listeners: defaultdict[int, list[str]] = defaultdict(list)
        for flow in flows:
            listeners[listener_of(flow, robots)].append(flow.topic)
        heard = [
            stack.enter_context(_hearing(folders[robot], topics))
            for robot, topics in listeners.items()
        ]
        outs = {flow.sender: stack.enter_context(Publisher(folders[flow.sender])) for flow in flows}
        begin = time.monotonic()
        for at, i, n in due:
            flow = flows[i]
            time.sleep(max(0.0, begin + at - time.monotonic()))
            payload = (CDR + _NUMBER.pack(n)).ljust(flow.size, b"\0")
            sent_at[flow.name, n] = time.monotonic()
            outs[flow.sender].send(flow.topic, payload, dst=flow.to)
        time.sleep(rest_s)
        arrived = {key: at for each in heard for key, at in dict(each).items()}
    ages: dict[str, dict[int, float]] = {flow.name: {} for flow in flows}
    for (topic, n), at in arrived.items():
        ages[topic][n] = at - sent_at[topic, n]
    return ages


def _start(
    stack: ExitStack, folder: Path, mcs: int | None, robots: Sequence[int]
) -> dict[int, Path]:
    """Start the hub and the daemons; returns the folders of their sockets, once they hear."""
    paths = written(folder, mcs, RATE, robots)
    scenario = folder / "scenario.toml"
    scenario.write_text(AIR + "".join(f"[[robot]]\nid = {robot}\n" for robot in robots))
    hub = ("sdrlinkd.cli.ether", str(scenario), "--dir", str(folder))
    started = [processes.start_module(stack, "hub", *hub)]
    for robot, path in paths.items():
        arguments = ("sdrlinkd", "--config", str(path), *QUIET)
        started.append(processes.start_module(stack, f"daemon_{robot}", *arguments))
    folders = {robot: folder / f"robot_{robot}" for robot in paths}
    wait_for(folders, started, hears_one)
    return folders


@contextmanager
def _hearing(folder: Path, topics: Sequence[str]) -> Iterator[dict[tuple[str, int], float]]:
    """Note when each message of other robots' `topics` came first, by topic and number."""
    found: dict[tuple[str, int], float] = {}
    is_over = threading.Event()

    def hear() -> None:
        names = [f"/rx_{topic.removeprefix('/')}" for topic in topics]
        with Subscriber(*names, runtime_dir=folder, depth=0) as heard:
            while not is_over.is_set():
                message = heard.receive(0.1)
                if message is not None:
                    key = (
                        message.topic.rpartition("/")[2],
                        _NUMBER.unpack_from(message.payload, 4)[0],
                    )
                    found.setdefault(key, time.monotonic())

    thread = threading.Thread(target=hear)
    thread.start()
    try:
        yield found
    finally:
        is_over.set()
        thread.join()
