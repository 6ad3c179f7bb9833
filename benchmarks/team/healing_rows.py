"""The rows on routes that heal."""

from collections.abc import Iterator
from functools import partial
from statistics import median

from benchmarks.report import Row
from benchmarks.team.healing import PERIOD_S, heal
from benchmarks.team.runs import Runs, all_of

ROWS = (("reroute_s", False), ("reroute_to_all_s", True))
COST = 30.0


def rows(runs: Runs, seed: int, quick: bool) -> Iterator[Row]:
    """How long a flow over several hops is away after its relay dies."""
    n = 2 if quick else 20
    trials = {
        name: [
            runs.add(f"{name}, trial {i}", COST, partial(heal, seed + i, to_all=to_all))
            for i in range(n)
        ]
        for name, to_all in ROWS
    }

    def found() -> Iterator[Row]:
        for name, _ in ROWS:
            healed = all_of(trials[name])
            yield Row(
                name, max(each.back_s for each in healed), "s", 0.4, "less", n,
                peers={
                    "median_s": median(each.back_s for each in healed),
                    "messages_lost": sum(each.lost for each in healed),
                    "messages": sum(each.sent for each in healed),
                    "control_pct": 100 * max(each.control_share for each in healed),
                },
                note=(
                    f"five robots, {1 / PERIOD_S:g} Hz over three hops, tdma; the worst of all "
                    "trials: from the death of the relay until the first message that was sent "
                    "after it"
                ),
            )  # fmt: skip

    return found()
