"""The ether: speed of lock-step with many daemons, and whether real time holds."""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import msgspec

from benchmarks.report import Row, main
from sdrlinkd.lab import LabOptions, LabReport, LabState, load_scenario, run_lab

SCENARIOS = Path(__file__).parents[1] / "etc" / "scenarios"


class Speed:
    """Ratio of the air's time to real time, between the first and the last call."""

    def __init__(self) -> None:
        self._first: tuple[float, float] | None = None
        self._last = (0.0, 0.0)

    def __call__(self, state: LabState) -> None:
        """Note the current time of the air."""
        if state.now_s < state.until_s and state.now_s > 0:
            self._last = (time.monotonic(), state.now_s)
            self._first = self._first or self._last

    @property
    def ratio(self) -> float:
        """Seconds of the air per second of real time; 1 is real time."""
        if self._first is None or self._last == self._first:
            return 0.0
        return (self._last[1] - self._first[1]) / (self._last[0] - self._first[0])


def measure(seed: int, quick: bool) -> list[Row]:
    """Measure both rows; `quick` runs a twentieth of the time."""
    duration_s = 1.0 if quick else 20.0
    speed = Speed()
    eight = _run("eight-robots", duration_s, seed, speed)
    two = _run("two-robots", duration_s, seed, lambda _: None)
    block = round(1e-3 * 5e6)
    lost = sum(robot.samples_lost for robot in two.robots)
    return [
        Row(
            "lockstep_8nodes_1msps_realtime_ratio", speed.ratio, "ratio", 0.5, "more", 1,
            peers={"pdr": eight.pdr}, note=f"{duration_s:g} s of eight daemons and a hub",
        ),
        Row(
            "realtime_2nodes_5msps_lost_blocks", lost / block, "blocks", 0.0, "less",
            round(2 * duration_s / 1e-3), peers={"pdr": two.pdr},
            note=f"{duration_s:g} s of two daemons and a hub",
        ),
    ]  # fmt: skip


def _run(name: str, duration_s: float, seed: int, watch: Callable[[LabState], None]) -> LabReport:
    path = SCENARIOS / f"{name}.toml"
    scenario = msgspec.structs.replace(load_scenario(path), duration_s=duration_s, seed=seed)
    return run_lab(LabOptions(path, scenario, None, None), watch)


if __name__ == "__main__":
    sys.exit(main("ether", measure))
