"""Latency through one daemon whose radio hears itself: laser, laser beside images, odometry."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import phy
from benchmarks import daemons
from benchmarks.flows import Flow
from benchmarks.processes import family_memory_mb
from benchmarks.realtime.traffic import Record, flow, play
from benchmarks.realtime.turns import Run

RATE_HZ = 5e6
LASER = """[channel]
snr_db = 25
[link]
pdu_size = 1058
[modem]
rate_hz = 5e6
mcs = 3
max_burst_s = 0.02
tx_lead_s = 0.001
block_s = 2.5e-4
[classes.bulk]
share = 0.05
max_burst_s = 0.003
[topic.laser]
qos = "latency"
[topic.image]
qos = "bulk"
"""
"""As in `benchmarks.pound`, 16QAM 1/2: a message of 1 KB takes 1.53 ms of the air."""
LASER_SIZE, LASER_S = 1032, 0.02
IMAGE_SIZE, IMAGE_S = 65_544, 0.15
MCS, PDU_SIZE = 1, 1024
ODOM = f"""[channel]
snr_db = 15
clock_ppm = 10
[link]
pdu_size = {PDU_SIZE}
[modem]
rate_hz = 5e6
mcs = {MCS}
"""
"""As in `benchmarks.modem_path`, QPSK 1/2: a message takes 2.85 ms of the air."""
ODOM_SIZE, ODOM_S = 724, 1 / 30
SECONDS, QUICK_S = 10.0, 3.0
"""Duration of a run in s, without its warm-up."""


def laser(tree: Path, seed: int, quick: bool) -> Run:
    """The laser by itself."""
    records = _play(tree, seed, [flow("laser", LASER_SIZE, LASER_S, seconds(quick))])
    return _mean_and_std("laser", records["laser"])


def laser_beside_image(tree: Path, seed: int, quick: bool) -> Run:
    """The laser while images of 64 KB wait, in the class for bulk."""
    flows = [
        flow("laser", LASER_SIZE, LASER_S, seconds(quick)),
        flow("image", IMAGE_SIZE, IMAGE_S, seconds(quick)),
    ]
    records = _play(tree, seed, flows)
    run, image = _mean_and_std("laser_beside_image", records["laser"]), records["image"]
    n_heard = len(image.sent) - image.lost
    return run._replace(note=f"{run.note}; {n_heard} of {len(image.sent)} images arrived, in "
                        f"{np.median(image.late_ms()):.0f} ms")  # fmt: skip


def odometry(tree: Path, seed: int, quick: bool) -> Run:
    """Odometry, and the memory of the daemon that has carried it."""
    wanted = [flow("odom", ODOM_SIZE, ODOM_S, seconds(quick))]
    with daemons.running("loopback", (1,), ("odom",), ODOM, "", tree=tree) as these:
        record = play(these.folders[1], these.folders[1], wanted, seed)["odom"]
        memory = family_memory_mb(these.processes[0].pid)
    p50, p99 = np.quantile(record.late_ms(), [0.5, 0.99], method="nearest")
    values = {"odom_30hz_ms_p50": float(p50), "odom_30hz_ms_p99": float(p99),
              "rss_mb": memory["Pss"]}  # fmt: skip
    rss = f"PSS of the daemon and all processes below it; their RSS is {memory['Rss']:.0f} MB"
    note = f"{airtime_ms():.2f} ms on the air; {record.lost} lost"
    return Run(values, len(record.sent), note, {"rss_mb": rss})


def airtime_ms() -> float:
    """The airtime of a burst with one PDU of odometry, in ms."""
    return 1e3 * phy.layout(phy.OFDM_64_16, MCS, 1, PDU_SIZE).n_samples / RATE_HZ


def seconds(quick: bool) -> float:
    """Duration of a run in s, without its warm-up."""
    return QUICK_S if quick else SECONDS


def _play(tree: Path, seed: int, flows: Sequence[Flow]) -> dict[str, Record]:
    topics = ("laser", "image")
    with daemons.running("loopback", (1,), topics, LASER, "", tree=tree) as these:
        return play(these.folders[1], these.folders[1], flows, seed)


def _mean_and_std(name: str, record: Record) -> Run:
    """Mean and standard deviation, both infinite if a message is lost."""
    late_ms = record.late_ms()
    spread_ms = float("inf") if record.lost else float(late_ms.std())
    p50, p99 = np.quantile(late_ms, [0.5, 0.99], method="nearest")
    values = {f"{name}_ms_mean": float(late_ms.mean()), f"{name}_ms_std": spread_ms}
    return Run(values, len(late_ms), f"p50 {p50:.2f}, p99 {p99:.2f} ms; {record.lost} lost")
