"""What a daemon costs that does nothing: CPU time, the time to start, and a look at its status."""

import contextlib
import os
import statistics
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import zmq

from benchmarks import daemons, processes
from benchmarks.absent import PeerError
from benchmarks.environments import interpreter, variables
from benchmarks.realtime.traffic import CDR, stamp
from benchmarks.realtime.turns import Run
from sdrlinkd.client import ControlClient
from sdrlinkd.family import family_cpu_s
from sdrlinkd.process import Process

SETTLE_S = 2.5
SECONDS, QUICK_S = 8.0, 3.0
LOOKS, QUICK_LOOKS = 7, 3
STARTS, QUICK_STARTS = 3, 1
START_S = 60.0
OFFER_MS = 20
"""A starting daemon is offered a message this often, from when its socket is there."""
RECONNECT_MS = 2
EXIT_CODES = (0, 1, 3)
"""Exit codes of `sdrlinkctl status` with a daemon: OK, DEGRADED, DOWN."""
PDU_TAP = b"\0pdu\0"
CONFIG = """[modem]
rate_hz = 5e6
"""
ALONE = """namespace = "robot_1"
registry = "registry.csv"
backend = "loopback"
[bus]
runtime_dir = "{folder}"
[modem]
rate_hz = 5e6
"""


class Spent(NamedTuple):
    """What a command took: seconds on the wall, and of CPU time."""

    wall_s: float
    cpu_s: float


def idle(tree: Path, seed: int, quick: bool) -> Run:  # noqa: ARG001
    """CPU time of a daemon without traffic but its beacons, and `sdrlinkctl status` of it."""
    span_s = QUICK_S if quick else SECONDS
    with daemons.running("loopback", (1,), ("odom",), CONFIG, "", tree=tree) as these:
        pid, folder = these.processes[0].pid, these.folders[1]
        time.sleep(SETTLE_S)
        air_s, before_s, began = _air_cpu_s(folder), family_cpu_s(pid), time.monotonic()
        time.sleep(span_s)
        took_s = time.monotonic() - began
        all_pct = 100 * (family_cpu_s(pid) - before_s) / took_s
        air_pct = 100 * (_air_cpu_s(folder) - air_s) / took_s
        looks = [_status(tree, folder) for _ in range(QUICK_LOOKS if quick else LOOKS)]
    values = {
        "idle_cpu_pct_5msps": all_pct - air_pct,
        "status_s": statistics.median(each.wall_s for each in looks),
    }
    cpu_s = statistics.median(each.cpu_s for each in looks)
    air = f"the simulated air's {air_pct:.1f} % apart" if air_pct else "with the simulated air"
    notes = {
        "idle_cpu_pct_5msps": f"of one core, with all processes below it; {air}",
        "status_s": f"{cpu_s:.2f} s of CPU time",
    }
    return Run(values, round(span_s), notes=notes)


def start(tree: Path, seed: int, quick: bool) -> Run:  # noqa: ARG001
    """Time from the start of the process until its first PDU is handed to the radio."""
    took_s = [_start_s(tree) for _ in range(QUICK_STARTS if quick else STARTS)]
    return Run({"start_s": statistics.median(took_s)}, len(took_s))


def _air_cpu_s(folder: Path) -> float:
    """CPU time in s of the simulated air by the daemon's own account; 0: it tells none."""
    with ControlClient(folder) as control:
        carrier: dict[str, Any] = control.ask("status")["carrier"]
    return 1e-3 * float(carrier["counters"].get("air_cpu_ms") or 0.0)


def _status(tree: Path, folder: Path) -> Spent:
    """Run `sdrlinkctl status`. Raises PeerError."""
    command = [interpreter(""), "-m", "sdrlinkd.cli", "status", "--runtime-dir", str(folder)]
    began = time.monotonic()
    process = subprocess.Popen(
        command, cwd=tree, env=variables(tree), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, code, used = os.wait4(process.pid, 0)
    took_s = time.monotonic() - began
    process.returncode = os.waitstatus_to_exitcode(code)
    if process.returncode not in EXIT_CODES:
        raise PeerError(f"sdrlinkctl status: exit code {process.returncode}")
    return Spent(took_s, used.ru_utime + used.ru_stime)


def _start_s(tree: Path) -> float:
    with TemporaryDirectory(prefix="benchmark-") as name, ExitStack() as stack:
        folder = Path(name)
        (folder / "registry.csv").write_text("odom,nav_msgs/Odometry\n")
        config = folder / "sdrlinkd.toml"
        config.write_text(ALONE.format(folder=folder))
        context = stack.enter_context(zmq.Context())
        push, tap = context.socket(zmq.PUSH), context.socket(zmq.SUB)
        tap.subscribe(PDU_TAP)
        push.immediate = True
        for socket, address in ((push, "in.sock"), (tap, "out.sock")):
            socket.linger = 0
            socket.reconnect_ivl = RECONNECT_MS
            stack.enter_context(socket)
            socket.connect(f"ipc://{folder}/{address}")
        began = time.monotonic()
        daemon = processes.start_module(
            stack, "daemon", "sdrlinkd", "--config", str(config), *daemons.QUIET, tree=tree
        )
        _offer(push, tap, daemon, began + START_S)
        return time.monotonic() - began


def _offer(
    push: zmq.Socket[bytes], tap: zmq.Socket[bytes], daemon: Process, deadline: float
) -> None:
    """Offer messages until the tap shows a PDU. Raises PeerError."""
    while not tap.poll(OFFER_MS):
        if not daemon.is_running or time.monotonic() > deadline:
            raise PeerError(f"the daemon sent nothing; {daemon.last_words()}")
        message = CDR + stamp(time.time_ns()) + bytes(712)
        with contextlib.suppress(zmq.Again):
            push.send_multipart([b"/robot_1/odom\0", b"\1\x80", message], zmq.NOBLOCK)
