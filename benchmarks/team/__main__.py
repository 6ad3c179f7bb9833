"""All rows: `python -m benchmarks.team`."""

import sys
from collections.abc import Iterator
from statistics import median

from benchmarks.report import Row, main
from benchmarks.team.healing import PERIOD_S, heal


def measure(seed: int, quick: bool) -> Iterator[Row]:
    """Measure all rows; `quick` takes a tenth of the trials."""
    n = 2 if quick else 20
    for name, to_all in (("reroute_s", False), ("reroute_to_all_s", True)):
        found = [heal(seed + i, to_all=to_all) for i in range(n)]
        yield Row(
            name, max(each.back_s for each in found), "s", 0.4, "less", n,
            peers={
                "median_s": median(each.back_s for each in found),
                "messages_lost": sum(each.lost for each in found),
                "messages": sum(each.sent for each in found),
                "control_pct": 100 * max(each.control_share for each in found),
            },
            note=(
                f"five robots, {1 / PERIOD_S:g} Hz over three hops, tdma; the worst of all trials: "
                "from the death of the relay until the first message that was sent after it"
            ),
        )  # fmt: skip


if __name__ == "__main__":
    sys.exit(main("team", measure))
