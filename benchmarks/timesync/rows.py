"""Rows: the accuracy of filters on the same streams."""

from collections import defaultdict
from collections.abc import Iterable, Iterator

import numpy as np

from benchmarks.report import Row
from benchmarks.timesync import ptp, samples
from benchmarks.timesync.filters import PEERS, Filter, Ours
from benchmarks.timesync.runs import RECOVERED_S, Course, follow
from benchmarks.timesync.streams import SCENARIOS, stream

TOLD = "ABCDJL"
AT_LEAST = {"A": 10.0, "B": 10.0, "C": 1.0, "D": 3.0, "J": 2.5, "L": 10.0}
MOST_US = {"A": 50.0, "B": 50.0, "L": 50.0}
PAPER = "paper_four_stamps"
STEPS_S = (0.003, -0.003, 0.01, -0.05, 0.05, 0.2, -0.2)
STEPPED = "ABL"
"""Scenarios with a step; in D no direction is ever idle, so a step of 3 ms is within its waits."""
STEP_AT_S, STEPPED_S = 40.0, 70.0


class Tally:
    """How many errors were within their bounds."""

    def __init__(self) -> None:
        self.good = self.all = 0

    def add(self, course: Course, *steps_at: float) -> None:
        """Count the bounds of one more run, without the 5 s after each step."""
        good, n = course.held(*steps_at)
        self.good, self.all = self.good + good, self.all + n

    @property
    def percent(self) -> float:
        """Percentage of bounds that held."""
        return 100 * self.good / max(1, self.all)


def precision(seed: int, runs: int, hz: float, held: Tally) -> dict[str, dict[str, list[Course]]]:
    """Run all filters; courses by scenario and name. `held` counts our bounds."""
    found: dict[str, dict[str, list[Course]]] = {}
    for scenario in SCENARIOS:
        courses: dict[str, list[Course]] = defaultdict(list)
        for run in range(runs):
            same = stream(scenario, seed * 1000 + run, hz=hz)
            for name, make in PEERS.items():
                courses[name].append(follow(make(), same))
            ours = follow(Ours(), same)
            courses["ours"].append(ours)
            held.add(ours)
        found[scenario] = dict(courses)
    return found


def rms_us(courses: Iterable[Course]) -> float:
    """RMS of the errors at the end of the runs that have an estimate by then."""
    errors = np.array([each.last_error_s for each in courses])
    known = errors[np.isfinite(errors)]
    return float(1e6 * np.sqrt(np.mean(np.square(known)))) if len(known) else float("inf")


def precision_rows(found: dict[str, dict[str, list[Course]]], hz: float) -> Iterator[Row]:
    """Errors at 60 s, and their ratio to the paper's."""
    rms = {of: {name: rms_us(each) for name, each in found[of].items()} for of in TOLD}
    for scenario in TOLD:
        peers = dict(rms[scenario])
        ours, paper, n = peers.pop("ours"), peers[PAPER], len(found[scenario]["ours"])
        target = MOST_US.get(scenario, paper / AT_LEAST[scenario])
        yield Row(f"rms_us_60s_{hz:g}hz_{scenario}", ours, "µs", target, "less", n, peers)
    for scenario in TOLD:
        gain = rms[scenario][PAPER] / rms[scenario]["ours"]
        n = len(found[scenario]["ours"])
        yield Row(f"gain_over_paper_{scenario}", gain, "", AT_LEAST[scenario], "more", n)
    settled = {
        of: float(np.median([each.settled_s() for each in found[of]["ours"]])) for of in "ABDL"
    }
    peers_s = {
        name: max(float(np.median([each.settled_s() for each in found[of][name]])) for of in "ABDL")
        for name in PEERS
    }
    told = ", ".join(f"{of} {value:.1f}" for of, value in settled.items())
    n = len(found["A"]["ours"])
    yield Row("below_1ms_after_s_median_worst", max(settled.values()), "s", 5.0, "less", n,
              peers_s, note=told)  # fmt: skip


def steps(seed: int, runs: int, hz: float, held: Tally) -> Row:
    """Time after a jump of the other clock until the error stays below 2 ms; the worst case."""
    took: dict[str, list[float]] = defaultdict(list)
    makes: dict[str, type[Filter]] = {PAPER: PEERS[PAPER], "ours": Ours}  # type: ignore[dict-item]
    for scenario in (*STEPPED, "D"):
        for number, step_s in enumerate(STEPS_S):
            for run in range(runs):
                jumps = stream(
                    scenario, seed * 1000 + 50 * number + run, hz=hz, seconds=STEPPED_S,
                    step=(STEP_AT_S, step_s),
                )  # fmt: skip
                for name, make in makes.items():
                    course = follow(make(), jumps)
                    key = name
                    if scenario == "D":
                        key = f"{name}_D_3ms" if abs(step_s) < 0.005 else f"{name}_D"
                    took[key].append(course.settled_s(RECOVERED_S, STEP_AT_S))
                    if name == "ours" and scenario != "D":
                        held.add(course, STEP_AT_S)
    worst = {name: max(each) for name, each in took.items()}
    peers = {name: _told(worst[name]) for name in worst if name != "ours"}
    peers["ours_D_3ms_median"] = float(np.median(took["ours_D_3ms"]))
    peers["paper_median"] = _told(float(np.median(took[PAPER])))
    return Row("step_recovery_s_worst", worst["ours"], "s", 5.0, "less", len(took["ours"]), peers,
               note=f"3 to 200 ms both ways, in {', '.join(STEPPED)}")  # fmt: skip


def _told(seconds: float) -> float:
    """A time as a number; "never" becomes the length of the run."""
    return seconds if np.isfinite(seconds) else STEPPED_S - STEP_AT_S


def hostile(seed: int, runs: int, hz: float, held: Tally) -> Iterator[Row]:
    """Bad stamps, and an oscillator that is off by 500 ppm."""
    for name, bad_share, skew_ppm in (
        ("bad_stamps_1pct_rms_us", 0.01, None),
        ("off_by_500ppm_rms_us", 0.0, 500.0),
    ):
        courses: dict[str, list[Course]] = defaultdict(list)
        for run in range(runs):
            same = stream("A", seed * 1000 + run, hz=hz, bad_share=bad_share, skew_ppm=skew_ppm)
            for peer, make in PEERS.items():
                courses[peer].append(follow(make(), same))
            courses["ours"].append(follow(Ours(), same))
            held.add(courses["ours"][-1])
        peers = {peer: rms_us(courses[peer]) for peer in PEERS}
        yield Row(name, rms_us(courses["ours"]), "µs", 50.0, "less", runs, peers)


def sample_clocks(seed: int, seconds: float) -> Row:
    """Stamps taken by sample count, through the modem and the air."""
    found = samples.measure(seed, seconds)
    bound_us = 1e6 * max(found.bounds_s)
    worst_us = 1e6 * max(map(abs, found.errors_s))
    return Row("sample_clock_rms_us_1msps", found.rms_us, "µs", 0.5, "less", len(found.errors_s),
               {"worst": worst_us, "bound": bound_us})  # fmt: skip


def recorded() -> Iterator[Row]:
    """PTP over Wi-Fi, if the recordings are available."""
    spreads: dict[str, list[float]] = defaultdict(list)
    n = 0
    for trace in ptp.traces():
        n += len(trace.at)
        for name, make in PEERS.items():
            spreads[name].append(ptp.spread_ms(make, trace))
        spreads["ours"].append(ptp.spread_ms(lambda: Ours(airtime_s=0.0), trace))
    if not n:
        return
    means = {name: float(np.mean(each)) for name, each in spreads.items()}
    ours = means.pop("ours")
    peers = {name: each for name, each in means.items() if np.isfinite(each)}
    note = "rms deviation from a line; the paper's filter rejects all: round trips exceed 10 ms"
    target = min(peers.values())
    yield Row("ptp_over_wifi_strays_ms", ours, "ms", target, "less", n, peers, note=note)
