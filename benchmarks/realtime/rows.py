"""The rows, and what measures each of them."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from benchmarks.realtime import ages, alone, costs, demo, full_air, pair, receiver, usrp
from benchmarks.realtime.turns import Measure, Wanted, in_turns, rows_of
from benchmarks.report import Row


class Experiment(NamedTuple):
    """Rows that one run measures together."""

    name: str
    measure: Measure
    rows: Sequence[Wanted]


EXPERIMENTS = (
    Experiment("laser", alone.laser, (
        Wanted("laser_ms_mean", "ms", 3.4),
        Wanted("laser_ms_std", "ms", 0.7),
    )),
    Experiment("laser beside images", alone.laser_beside_image, (
        Wanted("laser_beside_image_ms_mean", "ms", 4.0),
        Wanted("laser_beside_image_ms_std", "ms", 1.0),
    )),
    Experiment("odometry", alone.odometry, (
        Wanted("odom_30hz_ms_p50", "ms", 4.7),
        Wanted("odom_30hz_ms_p99", "ms", 9.0),
        Wanted("rss_mb", "MB", 110.0),
    )),
    Experiment("demo", demo.demo, (Wanted("demo_p99_ms", "ms", 20.0),)),
    Experiment("two daemons", pair.odometry, (
        Wanted("two_daemons_beyond_air_ms_mean", "ms", 4.0),
        Wanted("two_daemons_beyond_air_ms_p99", "ms", 10.0),
        Wanted("cpu_pct_two_robots_and_air_5msps", "%", 30.0),
    )),
    Experiment("ages", ages.age_error, (Wanted("age_error_us_p99", "µs", 500.0),)),
    Experiment("idle", costs.idle, (
        Wanted("idle_cpu_pct_5msps", "%", 5.0),
        Wanted("status_s", "s", 0.25),
    )),
    Experiment("full air at 10 Msps", full_air.lost_samples, (
        Wanted("loopback_10msps_lost_samples", "samples", 0.0),
    )),
    Experiment("full air at 20 Msps", full_air.carried_share, (
        Wanted("loopback_20msps_carried_share", "ratio", 0.95, "more"),
    )),
    Experiment("a radio like a USRP", usrp.full_load, (
        Wanted("usrp_like_5msps_lost_samples", "samples", 0.0),
        Wanted("usrp_like_5msps_cores", "cores", 1.3),
    )),
    Experiment("start", costs.start, (Wanted("start_s", "s", 0.7),)),
    Experiment("one burst", receiver.one_burst, (
        Wanted("rx_us_64B_burst_hot", "µs", 40.0),
        Wanted("rx_us_64B_burst_asleep_20ms", "µs", 120.0),
    )),
)  # fmt: skip
NAMES = tuple(row.name for experiment in EXPERIMENTS for row in experiment.rows)


def rows(names: Sequence[str], trees: Mapping[str, Path], seed: int, quick: bool) -> Iterator[Row]:
    """Measure the rows of these names; `trees` are this checkout and perhaps another one."""
    for name, measure, all_rows in EXPERIMENTS:
        wanted = [row for row in all_rows if row.name in names]
        if wanted:
            yield from rows_of(wanted, in_turns(name, measure, trees, seed, quick))
