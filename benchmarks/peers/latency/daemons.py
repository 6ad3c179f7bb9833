"""The daemons of this benchmark, and their configuration."""

from collections.abc import Collection, Mapping
from contextlib import AbstractContextManager
from typing import NamedTuple

from benchmarks import daemons

CONFIG = """[link]
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
PPM = {1: 18.0, 2: -16.0}


class Air(NamedTuple):
    """Common settings of all daemons of a run."""

    backend: str = "ether"
    rate_hz: float = 5e6
    mcs: int = 3
    pdu_size: int = 256
    block_s: float = 1e-3
    clock_s: float = 0.2
    share: float = 0.02


def running(
    air: Air,
    robots: Collection[int],
    topics: Collection[str],
    own: Mapping[int, str] | None = None,
) -> AbstractContextManager[daemons.Running]:
    """Run daemons, from when each hears another; `own`: TOML of single robots. Raises PeerError."""
    parts = [ROBOT.format(robot=robot, ppm=PPM[robot]) for robot in robots]
    scenario = SCENARIO.format(**air._asdict()) + "".join(parts)
    config = CONFIG.format(**air._asdict())
    return daemons.running(air.backend, robots, topics, config, scenario, precede=True, own=own)
