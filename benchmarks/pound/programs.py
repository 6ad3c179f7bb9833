"""Daemons, and the hub of their air, as programs of their own."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import NamedTuple

from benchmarks.pound.ours import MCS, PDU_SIZE, RATE_HZ, SNR_DB
from sdrlinkd.client import ControlClient, NoDaemonError

BLOCK_S = {"loopback": 2.5e-4, "ether": 5e-4}
"""Three programs on two cores have no time for more of them."""
MAX_BURST_S = 0.02
BULK_BURST_S = 0.003
LEAD_S = 0.001
START_S = 90.0
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
[outages]
times = {outages}
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


class Ends(NamedTuple):
    """Folders of the daemons that send and hear, and of their air."""

    sends: Path
    hears: Path
    air: Path


@contextmanager
def running(
    backend: str, nodes: Sequence[int], outages: Sequence[tuple[float, float]] = ()
) -> Iterator[Ends]:
    """Daemons that hear each other, or themselves; `outages` (begin, end) are in s of the air."""
    with tempfile.TemporaryDirectory(prefix="pound-") as name, ExitStack() as stack:
        folder = Path(name)
        for arguments in _set_up(folder, backend, nodes, outages):
            stack.enter_context(_Process(arguments, folder / "log"))
        _wait_for(folder, nodes)
        yield Ends(folder / "1", folder / str(nodes[-1]), folder / "air")


def _set_up(
    folder: Path, backend: str, nodes: Sequence[int], outages: Sequence[tuple[float, float]]
) -> list[list[str]]:
    """Write the files; the programs to start."""
    known = {"rate": RATE_HZ, "snr": SNR_DB, "block": BLOCK_S[backend]}
    (folder / "scenario.toml").write_text(
        SCENARIO.format(outages=[list(each) for each in outages], **known)
    )
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
