"""Two daemons and the hub of their air: latency beyond the airtime, and CPU time of it all."""

import time
from pathlib import Path

import numpy as np

from benchmarks import daemons
from benchmarks.realtime.ages import p99_us
from benchmarks.realtime.alone import MCS, ODOM_SIZE, PDU_SIZE, RATE_HZ, airtime_ms, seconds
from benchmarks.realtime.traffic import flow, play
from benchmarks.realtime.turns import Run
from sdrlinkd.family import family_cpu_s

ODOM_S = 1 / 25
SETTLE_S = 2.0
"""Time in which the robots learn each other's clocks."""
SCENARIO = f"""pace = "realtime"
[air]
rate_hz = {RATE_HZ}
snr_db = 20
[[robot]]
id = 1
radio = {{ full_duplex = true, clock_ppm = 4.0 }}
[[robot]]
id = 2
radio = {{ full_duplex = true, clock_ppm = -6.0 }}
"""
CONFIG = f"""[link]
pdu_size = {PDU_SIZE}
[modem]
rate_hz = {RATE_HZ}
mcs = {MCS}
[access]
policy = "none"
nodes = [1, 2]
force = true
"""


def odometry(tree: Path, seed: int, quick: bool) -> Run:
    """Odometry from robot 1 to robot 2. Raises PeerError if robot 2 knows no age."""
    wanted = [flow("odom", ODOM_SIZE, ODOM_S, seconds(quick))]
    with daemons.running("ether", (1, 2), ("odom",), CONFIG, SCENARIO, tree=tree) as these:
        time.sleep(SETTLE_S)
        before_s, began = _cpu_s(these), time.monotonic()
        record = play(these.folders[1], these.folders[2], wanted, seed, dated=True)["odom"]
        cpu_pct = 100 * (_cpu_s(these) - before_s) / (time.monotonic() - began)
    beyond_ms = record.late_ms() - airtime_ms()
    values = {
        "two_daemons_beyond_air_ms_mean": float(beyond_ms.mean()),
        "two_daemons_beyond_air_ms_p99": float(np.quantile(beyond_ms, 0.99, method="nearest")),
        "cpu_pct_two_robots_and_air_5msps": cpu_pct,
    }
    note = (
        f"{airtime_ms():.2f} ms on the air; {record.lost} lost; p99 of the ages' error "
        f"{p99_us(record):.0f} µs"
    )
    return Run(values, len(record.sent), note)


def _cpu_s(these: daemons.Running) -> float:
    """CPU time of both daemons, the hub and all processes below them, in s."""
    return sum(family_cpu_s(process.pid) for process in these.processes)
