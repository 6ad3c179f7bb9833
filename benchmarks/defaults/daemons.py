"""The same with whole programs: two daemons, and the hub of their air, in real time."""

import struct
import tempfile
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from benchmarks import processes
from benchmarks.daemons import hears_one, wait_for
from benchmarks.defaults.team import CDR, LISTENER, SENDER, Flow, written
from sdrlinkd.client import ControlClient, Publisher, Subscriber

QUIET = ("--log-level", "warning")
AIR = """pace = "realtime"
duration_s = 3600.0
[air]
rate_hz = 2e6
snr_db = 25.0
[[robot]]
id = 1
[[robot]]
id = 2
"""
RATE = "2 Msps"
"""What this machine keeps up with; `init` writes 5 Msps."""
REST_S = 1.0
"""Time in s after the last message, so that it may arrive."""
_NUMBER = struct.Struct("<I")

Ages = Mapping[str, Mapping[int, float]]
"""The age in s at which each message arrived, by topic and number."""


def drive_daemons(flows: Sequence[Flow], mcs: int | None, rest_s: float = REST_S) -> Ages:
    """Let one daemon send all messages of `flows`, and hear them from the other.

    Raises PeerError.
    """
    with tempfile.TemporaryDirectory(prefix="benchmark-") as name, ExitStack() as stack:
        folders = _start(stack, Path(name), mcs)
        with ControlClient(folders[SENDER]) as control:
            for flow in flows:
                arguments: dict[str, bool | int | float | str | bytes | None] = {
                    "name": f"/robot_{SENDER}/{flow.name}", "type": flow.type,
                    "reliability": flow.reliability, "durability": flow.durability,
                    "depth": flow.depth,
                }  # fmt: skip
                control.ask("declare", arguments)
        due = sorted((at, i, n) for i, flow in enumerate(flows) for n, at in enumerate(flow.times))
        sent_at: dict[tuple[str, int], float] = {}
        with _hearing(folders[LISTENER]) as heard_at, Publisher(folders[SENDER]) as out:
            begin = time.monotonic()
            for at, i, n in due:
                flow = flows[i]
                time.sleep(max(0.0, begin + at - time.monotonic()))
                payload = (CDR + _NUMBER.pack(n)).ljust(flow.size, b"\0")
                sent_at[flow.name, n] = time.monotonic()
                out.send(f"/robot_{SENDER}/{flow.name}", payload, dst=flow.to)
            time.sleep(rest_s)
            arrived = dict(heard_at)
    ages: dict[str, dict[int, float]] = {flow.name: {} for flow in flows}
    for (topic, n), at in arrived.items():
        ages[topic][n] = at - sent_at[topic, n]
    return ages


def _start(stack: ExitStack, folder: Path, mcs: int | None) -> dict[int, Path]:
    """Start the hub and the daemons; returns the folders of their sockets, once they hear."""
    paths = written(folder, mcs, RATE)
    scenario = folder / "scenario.toml"
    scenario.write_text(AIR)
    hub = ("sdrlinkd.cli.ether", str(scenario), "--dir", str(folder))
    started = [processes.start_module(stack, "hub", *hub)]
    for robot, path in paths.items():
        arguments = ("sdrlinkd", "--config", str(path), *QUIET)
        started.append(processes.start_module(stack, f"daemon_{robot}", *arguments))
    folders = {robot: folder / f"robot_{robot}" for robot in paths}
    wait_for(folders, started, hears_one)
    return folders


@contextmanager
def _hearing(folder: Path) -> Iterator[dict[tuple[str, int], float]]:
    """Note when each message came first, by topic and number."""
    found: dict[tuple[str, int], float] = {}
    is_over = threading.Event()

    def hear() -> None:
        with Subscriber(f"/rx_robot_{SENDER}/*", runtime_dir=folder, depth=0) as heard:
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
