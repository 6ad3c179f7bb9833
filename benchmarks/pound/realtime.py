"""The laser and the camera by the clock, on whatever this machine is.

One daemon whose radio hears itself; beside it two daemons and the hub of their air, which is three
programs on the same cores.
"""

import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.pound.flows import Flow, Times, Trace, figures
from benchmarks.pound.limits import BULK_BYTES, SLACK_RT_MS
from benchmarks.pound.ours import CDR, MCS, PDU_SIZE, RATE_HZ, SNR_DB
from benchmarks.report import Row
from sdrlinkd.client import ControlClient, NoDaemonError, Publisher, Subscriber

BLOCK_S = 1e-3
MAX_BURST_S = 0.02
BULK_BURST_S = 0.003
LEAD_S = 0.001
START_S = 90.0
DRAIN_S = 2.0
SCENARIO = """pace = "realtime"
[air]
rate_hz = {rate}
snr_db = {snr}
block_s = {block}
[[robot]]
id = 1
radio = {{ full_duplex = true, clock_ppm = 4.0 }}
[[robot]]
id = 2
radio = {{ full_duplex = true, clock_ppm = -6.0 }}
"""
DAEMON = """namespace = "robot_{node}"
registry = "registry.csv"
rx_depth = 0
backend = "{backend}"
[bus]
runtime_dir = "{folder}/{node}"
[ether]
dir = "{folder}/air"
[channel]
snr_db = {snr}
[link]
pdu_size = {pdu_size}
[modem]
rate_hz = {rate}
mcs = {mcs}
max_burst_s = {max_burst}
tx_lead_s = {lead}
block_s = {block}
[classes.bulk]
share = 0.05
max_burst_s = {bulk_burst}
[topic.laser]
qos = "latency"
[topic.image]
qos = "bulk"
[topic.stop]
qos = "urgent"
"""
REGISTRY = "".join(f"{name},std_msgs/UInt8MultiArray\n" for name in ("laser", "image", "stop"))


def rows(seed: int, quick: bool) -> list[Row]:
    """Those that have a target in real time."""
    with _running("ether", (1, 2)) as ends:
        beside = {row.name: row.value for row in _tables(ends, seed, quick)}
    with _running("loopback", (1,)) as ends:
        made = [*_tables(ends, seed, quick), *_limits(ends, seed, quick)]
    for row in made:
        if row.name in beside:
            row.peers["two daemons and a hub"] = beside[row.name]
    return made


class _Ends(NamedTuple):
    """Folders of the daemons that send and hear."""

    sends: Path
    hears: Path


@contextmanager
def _running(backend: str, nodes: Sequence[int]) -> Iterator[_Ends]:
    with tempfile.TemporaryDirectory(prefix="pound-") as name, ExitStack() as stack:
        folder = Path(name)
        for arguments in _set_up(folder, backend, nodes):
            stack.enter_context(_Process(arguments, folder / "log"))
        _wait_for(folder, nodes)
        yield _Ends(folder / "1", folder / str(nodes[-1]))


def _tables(ends: _Ends, seed: int, quick: bool) -> list[Row]:
    n = 250 if quick else 1000
    rng = np.random.default_rng(seed)
    flows = [
        Flow("laser", 1024, 0.02, n, phase_s=rng.uniform(0, 0.02)),
        Flow("image", 65536, 0.15, int(n * 0.02 / 0.15), phase_s=rng.uniform(0, 0.15)),
    ]
    traces = _play(ends, flows, seed)
    laser, image = (figures(trace) for trace in traces)
    p99 = 1e3 * float(np.nanquantile(traces[0].heard_at - traces[0].sent_at, 0.99))
    note = f"laser p50 {1e3 * _median(traces[0]):.2f} ms, p99 {p99:.2f} ms"
    return [
        Row("laser_2n_D_ms_rt", laser.d_ms, "ms", 3.5, "less", n, paper=4.1, note=note),
        Row("laser_2n_stdD_ms_rt", laser.std_d_ms, "ms", 1.0, "less", n, paper=4.0),
        Row("laser_2n_stdJd_ms_rt", laser.std_jd_ms, "ms", 1.3, "less", n, paper=2.0),
        Row("image_2n_D_ms_rt", image.d_ms, "ms", 108, "less", flows[1].count, paper=112.0),
        Row("image_2n_stdD_ms_rt", image.std_d_ms, "ms", 3, "less", flows[1].count, paper=1.9),
        Row("mdr_2n_laser_pct_rt", laser.mdr_pct, "%", 100, "more", n, paper=99.8),
        Row("mdr_2n_image_pct_rt", image.mdr_pct, "%", 100, "more", flows[1].count, paper=99.9),
    ]


def _limits(ends: _Ends, seed: int, quick: bool) -> list[Row]:
    """Bandwidth, and urgent messages while 10 MB wait."""
    rng = np.random.default_rng(seed)
    seconds = 3.0 if quick else 8.0
    offered = 8e-6 * 65536 / 6.5
    (bulk,) = _play(ends, [Flow("image", 65536, offered, int(seconds / offered))], seed)
    heard = np.sort(bulk.heard_at[~np.isnan(bulk.heard_at)])
    heard = heard[heard < seconds]
    mbps = 8e-6 * 65536 * (len(heard) - 1) / float(heard[-1] - heard[0])
    n = 40 if quick else 150
    length_s = n / 20
    n_bulk = int(min(BULK_BYTES, length_s * 5.5e6 / 8) / 50_000)
    stop = Flow("stop", 16, length_s / n, n, jitter_s=0.02, phase_s=0.3 + rng.uniform(0, 0.01))
    traces = _play(ends, [stop, Flow("image", 50_000, 1e-4, n_bulk)], seed)
    ages = 1e3 * (traces[0].heard_at - traces[0].sent_at)
    own_ms = 1e3 * 1.5264e-3
    return [
        Row("user_mbps_64KB_of_6.0_rt", mbps, "Mbit/s", 5.5, "more", len(heard), paper=5.1),
        Row("urgent_p99_ms_rt", float(np.nanquantile(ages, 0.99)), "ms",
            1e3 * BULK_BURST_S + own_ms + SLACK_RT_MS, "less", n,
            {"p50": float(np.nanmedian(ages))}),
    ]  # fmt: skip


def _median(trace: Trace) -> float:
    return float(np.nanmedian(trace.heard_at - trace.sent_at))


def _set_up(folder: Path, backend: str, nodes: Sequence[int]) -> list[list[str]]:
    """Write the files; the programs to start."""
    known = {"rate": RATE_HZ, "snr": SNR_DB, "block": BLOCK_S}
    (folder / "scenario.toml").write_text(SCENARIO.format(**known))
    (folder / "registry.csv").write_text(REGISTRY)
    hub = ["sdrlinkd.cli.ether", str(folder / "scenario.toml"), "--dir", str(folder / "air")]
    programs = [hub] if backend == "ether" else []
    for node in nodes:
        text = DAEMON.format(
            node=node, folder=folder, backend=backend, pdu_size=PDU_SIZE, mcs=MCS,
            max_burst=MAX_BURST_S, lead=LEAD_S, bulk_burst=BULK_BURST_S, **known,
        )  # fmt: skip
        path = folder / f"{node}.toml"
        path.write_text(text)
        programs.append(["sdrlinkd", "--config", str(path)])
    return programs


class _Process:
    """A program of ours while this runs."""

    def __init__(self, arguments: list[str], log: Path) -> None:
        self._arguments = arguments
        self._log = log

    def __enter__(self) -> None:
        with self._log.open("a") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", *self._arguments], stdout=log, stderr=log
            )

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        try:
            self._process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _wait_for(folder: Path, nodes: Sequence[int]) -> None:
    """Until every daemon hears one."""
    until = time.monotonic() + START_S
    while time.monotonic() < until:
        try:
            heard = 0
            for node in nodes:
                with ControlClient(folder / str(node)) as control:
                    heard += len(control.ask("peers"))
            if heard == len(nodes):
                return
        except (NoDaemonError, OSError):
            pass
        time.sleep(0.2)
    raise RuntimeError(f"the daemons hear nobody: {(folder / 'log').read_text()}")


def _play(ends: _Ends, flows: list[Flow], seed: int) -> list[Trace]:
    """Publish at robot 1 by an exact clock, listen at robot 2."""
    rng = np.random.default_rng(seed)
    times = [flow.times(rng) for flow in flows]
    heard: dict[str, Times] = {flow.name: np.full(flow.count, np.nan) for flow in flows}
    began = [0.0]
    ended = threading.Event()

    def listen(ready: threading.Event) -> None:
        with Subscriber(*[f"/rx_robot_1/{f.name}" for f in flows], directory=ends.hears) as ear:
            ready.set()
            while not ended.is_set():
                message = ear.receive(0.2)
                if message is not None:
                    at = time.monotonic()
                    number = int.from_bytes(message.payload[4:8], "little")
                    heard[message.topic.rsplit("/", 1)[-1]][number] = at - began[0]

    ready = threading.Event()
    listener = threading.Thread(target=listen, args=(ready,), daemon=True)
    listener.start()
    ready.wait(10)
    due = sorted((float(at), i, n) for i, of in enumerate(times) for n, at in enumerate(of))
    sent = [np.full(flow.count, np.nan) for flow in flows]
    with Publisher(ends.sends) as out:
        began[0] = time.monotonic() + 0.3
        for at, i, n in due:
            _sleep_until(began[0] + at)
            payload = CDR + n.to_bytes(4, "little") + bytes(flows[i].size)
            sent[i][n] = at
            out.send(f"/robot_1/{flows[i].name}", payload)
        time.sleep(DRAIN_S)
    ended.set()
    listener.join()
    return [Trace(flow, at, heard[flow.name]) for flow, at in zip(flows, sent, strict=True)]


def _sleep_until(at: float) -> None:
    while (left := at - time.monotonic()) > 0:
        time.sleep(max(0.0, left - 2e-4) if left > 4e-4 else 0.0)
