"""The rows on radios with a long turnaround."""

from collections.abc import Iterator
from functools import partial

from benchmarks.report import Row
from benchmarks.team.runs import Runs
from benchmarks.team.turnaround import ROBOTS, wait_for_turns

QUICK_S, WHOLE_S = 30.0, 300.0
CASES = (("standing", 64, 1.2), ("request", 2048, 2.3))


def rows(runs: Runs, seed: int, quick: bool) -> Iterator[Row]:
    """How many rounds something urgent waits, if it fits the standing turns, and if it does not."""
    duration_s = QUICK_S if quick else WHOLE_S
    waits = {
        name: runs.add(
            f"slow radios, {size} B", ROBOTS * duration_s,
            partial(wait_for_turns, size, seed, duration_s),
        )
        for name, size, _ in CASES
    }  # fmt: skip

    def found() -> Iterator[Row]:
        for name, size, target in CASES:
            ours = waits[name].result()
            rounds = ours.p99_s / ours.longest_round_s
            yield Row(
                f"grant_halfduplex_50ms_urgent_p99_over_frame_{name}", rounds, "rounds", target,
                "less", ours.n,
                peers={"mdr": ours.mdr, "longest_round_ms": 1e3 * ours.longest_round_s},
                note=(
                    "five radios, turnaround 50 ms; four have more bulk than the air carries, the "
                    f"fifth sends {size} B at random, once a second; a frame is the longest round; "
                    "a message that goes on later than 1 s after it was begun is given up, see mdr"
                ),
            )  # fmt: skip

    return found()
