"""Daemons of a benchmark, as programs of their own, and what they are told."""

import time
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from benchmarks.latency.processes import Child, PeerError
from sdrlinkd.client import ControlClient, NoDaemonError

START_S = 90.0
TYPE = "std_msgs/UInt8MultiArray"
DAEMON = """namespace = "robot_{robot}"
registry = "registry.csv"
rx_depth = 0
backend = "{backend}"
[bus]
runtime_dir = "{folder}/{robot}"
[ether]
dir = "{folder}/air"
[link]
pdu_size = {pdu_size}
[modem]
rate_hz = {rate_hz}
mcs = {mcs}
block_s = {block_s}
tx_lead_s = 0.001
[clock]
period_s = {clock_s}
share = {share}
"""
SCENARIO = """pace = "realtime"
[air]
rate_hz = {rate_hz}
snr_db = 25
block_s = {block_s}
"""
ROBOT = """[[robot]]
id = {robot}
radio = {{ full_duplex = true, clock_ppm = {ppm} }}
"""
PPM = (18.0, -16.0)


class Air(NamedTuple):
    """What all daemons of a run have in common."""

    backend: str = "ether"
    rate_hz: float = 5e6
    mcs: int = 3
    pdu_size: int = 256
    block_s: float = 1e-3
    clock_s: float = 0.2
    share: float = 0.02


class Running(NamedTuple):
    """Folders of the daemons' sockets by robot, and the processes."""

    folders: dict[int, Path]
    children: list[Child]


@contextmanager
def running(air: Air, robots: Collection[int], topics: Collection[str]) -> Iterator[Running]:
    """Until every daemon hears one, and then. Raises PeerError."""
    with TemporaryDirectory(prefix="latency-") as name, ExitStack() as stack:
        folder = Path(name)
        (folder / "registry.csv").write_text("".join(f"{each},{TYPE}\n" for each in topics))
        children = []
        if air.backend == "ether":
            children.append(stack.enter_context(_hub(folder, air, robots)))
            children[0].precede(real_time=False)
        for robot in robots:
            path = folder / f"{robot}.toml"
            path.write_text(DAEMON.format(robot=robot, folder=folder, **air._asdict()))
            daemon = Child(
                f"daemon_{robot}", "sdrlinkd", "--config", str(path), "--log-level", "warning"
            )
            children.append(stack.enter_context(daemon))
            daemon.precede(real_time=False)
        folders = {robot: folder / str(robot) for robot in robots}
        _wait_for(folders)
        yield Running(folders, children)


def _hub(folder: Path, air: Air, robots: Collection[int]) -> Child:
    scenario = folder / "scenario.toml"
    parts = [ROBOT.format(robot=robot, ppm=ppm) for robot, ppm in zip(robots, PPM, strict=True)]
    scenario.write_text(SCENARIO.format(**air._asdict()) + "".join(parts))
    return Child("hub", "sdrlinkd.cli.ether", str(scenario), "--dir", str(folder / "air"))


def _wait_for(folders: dict[int, Path]) -> None:
    until = time.monotonic() + START_S
    while time.monotonic() < until:
        try:
            heard = 0
            for folder in folders.values():
                with ControlClient(folder) as control:
                    heard += len(control.ask("peers"))
            if heard == len(folders):
                return
        except (NoDaemonError, OSError):
            pass
        time.sleep(0.2)
    raise PeerError("the daemons hear nobody")
