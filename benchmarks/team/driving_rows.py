"""The rows on robots that drive about."""

from collections.abc import Iterator
from functools import partial

from benchmarks.report import Row
from benchmarks.team.driving import AFTER_S, BEFORE_S, HEARD_DB, SIDE_M, N, drive
from benchmarks.team.runs import Runs


def rows(runs: Runs, seed: int, quick: bool) -> Iterator[Row]:
    """What arrives while there is a path."""
    duration_s = 15.0 if quick else 600.0
    run = runs.add("robots that drive", N * duration_s, partial(drive, "grant", seed, duration_s))

    def found() -> Iterator[Row]:
        ours = run.result()
        for qos, target in (("urgent", 0.9999), ("latency", 0.999), ("default", 0.99)):
            yield Row(
                f"mobile_8_mdr_{qos}", ours.mdr(qos), "ratio", target, "more", ours.sent[qos],
                peers={"hops": ours.hops, "without_path": ours.without_path[qos]},
                note=(
                    f"seven robots drive in a square of {SIDE_M:g} m, a base stands at its edge: "
                    "odometry and status to the base, commands from it; messages count if there "
                    f"was a path of links of {HEARD_DB:g} dB or more from {BEFORE_S:g} s before "
                    f"them to {AFTER_S:g} s after; policy grant"
                ),
            )  # fmt: skip

    return found()
