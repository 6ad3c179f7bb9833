"""The error of the ages that a daemon tells, beside a busy program on every core.

There bursts leave late, and their messages are older than planned. The error is exact: it does not
contain the hop from the daemon to its consumer. The daemon tells `tl`, the time of publication. It
is the host's time at the handover minus the age that the daemon tells. Producer and daemon are on
one host and use its clock. So `tl` minus the producer's stamp is the true age at the handover minus
the told one.
"""

from pathlib import Path

import numpy as np

from benchmarks import daemons
from benchmarks.absent import PeerError
from benchmarks.processes import busy_cores
from benchmarks.realtime.alone import ODOM, ODOM_S, ODOM_SIZE, seconds
from benchmarks.realtime.traffic import Record, flow, play
from benchmarks.realtime.turns import Run


def age_error(tree: Path, seed: int, quick: bool) -> Run:
    """Odometry through one daemon that hears itself. Raises PeerError if no age is known."""
    wanted = [flow("odom", ODOM_SIZE, ODOM_S, seconds(quick))]
    with daemons.running("loopback", (1,), ("odom",), ODOM, "", tree=tree) as these:
        folder = these.folders[1]
        quiet = play(folder, folder, wanted, seed, dated=True)["odom"]
        with busy_cores():
            busy = play(folder, folder, wanted, seed, dated=True)["odom"]
    p50, p99 = np.quantile(busy.late_ms(), [0.5, 0.99], method="nearest")
    note = (
        f"a busy program on every core: latency p50 {p50:.1f}, p99 {p99:.1f} ms; without them the "
        f"error's p99 is {p99_us(quiet):.0f} µs; {busy.lost} lost"
    )
    return Run({"age_error_us_p99": p99_us(busy)}, len(busy.age_errors_us()), note)


def p99_us(record: Record) -> float:
    """The 99th percentile of the errors' magnitudes in µs. Raises PeerError without an age."""
    errors_us = record.age_errors_us()
    if not len(errors_us):
        raise PeerError("the daemon told no message's age")
    return float(np.quantile(abs(errors_us), 0.99, method="nearest"))
