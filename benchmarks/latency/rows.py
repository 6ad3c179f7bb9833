"""Rows: the paper's Table 3 as an emulation, and the quality of clocks and ages."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from statistics import median

import numpy as np

from benchmarks.absent import attempt
from benchmarks.latency import airtime, clocks, control, lockstep
from benchmarks.latency.correction import Direction
from benchmarks.latency.session import Session, run
from benchmarks.peers.latency.table import PEERS
from benchmarks.report import Row
from sdrlinkd.config import ModemParams
from sdrlinkd.modem import Airtimes

OURS = ("direct", "ether")
TOLD = ("mavlink", "mavros", "xrce", *OURS)
BESIDE = ("mavlink", "xrce")
"""Peers that are also measured under stress and with more topics."""
PAPER_MS = {
    ("xrce", "fwd"): (1.329, 0.162),
    ("xrce", "bwd"): (1.752, 0.315),
    ("mavros", "fwd"): (1.678, 0.560),
    ("mavros", "bwd"): (2.133, 1.020),
}
"""Table 3: mean and standard deviation; its MAVLink is the one with MAVROS."""
TARGET_MS = {"direct": (1.33, 0.16)}
ANY_MS = 1e3
"""Limit for rows without a real target: peers, and totals of which only a part has one."""
SHARE_PCT = 2.0


def sessions(
    seed: int,
    seconds: float,
    passes: int,
    *,
    stress: bool = False,
    n_topics: int = 1,
    of: Iterable[str] = TOLD,
) -> dict[str, list[Session]]:
    """All passes of each peer that can run."""
    found = defaultdict[str, list[Session]](list)
    for name in of:
        with attempt(name):
            for each in range(passes):
                found[name].append(
                    run(name, seconds=seconds, stress=stress, n_topics=n_topics, seed=seed + each)
                )
    return {name: passed for name, passed in found.items() if passed}


def ways(session: Session) -> dict[str, Direction]:
    """The two directions: companion to FCU, and back."""
    return {"fwd": session.forward, "bwd": session.backward}


def table(found: dict[str, list[Session]]) -> Iterator[Row]:
    """Mean and standard deviation each way, as medians of the passes."""
    for name, passes in found.items():
        for way in ("fwd", "bwd"):
            each = [ways(session)[way] for session in passes]
            n = sum(one.n_heard for one in each)
            peers = {
                "true_mean": median(_ms(one.true_s, np.mean) for one in each),
                "true_p50": median(_ms(one.true_s, np.median) for one in each),
                "true_p99": median(_ms(one.true_s, _p99) for one in each),
                "filter_error_us": median(_us(one.filter_error_s) for one in each),
                "lost": float(sum(one.n_sent - one.n_heard for one in each)),
            }
            paper = PAPER_MS.get((name, way), (None, None))
            target = TARGET_MS.get(name, (ANY_MS, ANY_MS))
            for what, of, number in (("mean", np.nanmean, 0), ("std", np.nanstd, 1)):
                value = median(_ms(_corrected(one), of) for one in each)
                yield Row(f"{name}_115B_200hz_{what}_ms_{way}", value, "ms", target[number],
                          "less", n, peers if what == "mean" else {},
                          paper=paper[number], note=PEERS[name].of)  # fmt: skip


def load(found: dict[str, list[Session]]) -> Iterator[Row]:
    """CPU time and memory of everything between the two programs, and of the programs."""
    for what, unit in (("cpu_share", "cores"), ("rss_mib", "MiB")):
        totals = {
            name: median(sum(getattr(each, what).values()) for each in passes)
            for name, passes in found.items()
        }
        if "direct" in totals:
            peers = {name: value for name, value in totals.items() if name != "direct"}
            yield Row(f"direct_{what}", totals["direct"], unit, max([*peers.values(), 1.0]),
                      "less", len(found["direct"]), peers)  # fmt: skip


def beyond_air(found: dict[str, list[Session]]) -> Iterator[Row]:
    """Latency of messages over the ether in excess of the airtime, in real time."""
    if "ether" not in found:
        return
    air_ms = 1e3 * lockstep.airtime_s()
    n = sum(way.n_heard for each in found["ether"] for way in ways(each).values())
    for what, of, target in (("mean", np.mean, 3.0), ("p99", _p99, 8.0)):
        values = [
            _ms(way.true_s, of) - air_ms for each in found["ether"] for way in ways(each).values()
        ]
        yield Row(f"ether_115B_200hz_beyond_air_{what}_ms", median(values), "ms", target, "less",
                  n, {"airtime": air_ms, "best_pass": min(values)})  # fmt: skip


def by_the_air(seed: int, seconds: float) -> Iterator[Row]:
    """Latency in lock-step: only what the protocol adds."""
    found = lockstep.measure(seed, seconds)
    late_ms, n = 1e3 * found.latencies_s, len(found.latencies_s)
    yield Row("ether_115B_200hz_lockstep_std_ms", float(late_ms.std()), "ms", 0.08, "less",
              n, {"mean": float(late_ms.mean()), "airtime": 1e3 * found.airtime_s})  # fmt: skip
    yield Row("age_rms_us_lockstep", _us(found.age_errors_s), "µs", 20.0, "less", n)


def by_the_clock(seconds: float) -> Iterator[Row]:
    """Two daemons in real time: the quality of their estimates of each other."""
    air = clocks.AIR
    modem = ModemParams(rate_hz=air.rate_hz, mcs=air.mcs, block_s=air.block_s)
    airtime_s = Airtimes(modem, air.pdu_size).airtime_s(air.mcs, 1)
    ages: list[float] = []
    for hz, target in ((5.0, 500.0), (50.0, 200.0)):
        found = clocks.measure(hz, seconds, airtime_s)
        ages += found.ages_s.tolist()
        yield Row(f"e2e_offset_rms_us_{hz:g}hz", _us(found.offsets_s), "µs", target, "less",
                  len(found.offsets_s), {"worst": 1e6 * float(np.abs(found.offsets_s).max()),
                                         "within_bound_pct": 100 * found.within})  # fmt: skip
    errors_us = 1e6 * np.array(ages)
    peers = {f"p{q:g}": float(np.percentile(errors_us, q)) for q in (1, 50, 90, 99)}
    yield Row("age_rms_us_realtime", float(np.sqrt(np.mean(errors_us**2))), "µs", 300.0, "less",
              len(ages), peers)  # fmt: skip


def shares(seed: int, seconds: float) -> Iterator[Row]:
    """The share of the air that CLOCKs and RECEIPTs take."""
    for name, case in (
        ("control_airtime_pct_5nodes", airtime.FAST),
        ("control_airtime_pct_5nodes_1msps", airtime.SLOW),
    ):
        found = airtime.measure(case, seed, seconds)
        peers = {"period_s": found.period_s, "all_pct": found.all_pct}
        peers |= {f"receipts_{fate}": float(n) for fate, n in found.verdicts.items()}
        yield Row(name, found.control_pct, "%", SHARE_PCT, "less", round(seconds), peers)


def more_topics(
    seed: int, seconds: float, quick: bool, beside: Sequence[str] = BESIDE
) -> Iterator[Row]:
    """The paper's future work: latency with more topics, 200 Hz each."""
    peers: dict[str, float] = {}
    for n_topics in (2,) if quick else (2, 4, 7):
        for name, each in sessions(
            seed, seconds, 1, n_topics=n_topics, of=(*beside, "direct")
        ).items():
            peers[f"{name}_{n_topics}"] = _ms(each[0].forward.true_s, np.mean)
            peers[f"{name}_{n_topics}_lost_pct"] = 100 * (
                1 - each[0].forward.n_heard / max(1, each[0].forward.n_sent)
            )
    shown = "direct_2" if quick else "direct_4"
    if shown in peers:
        yield Row("direct_topics_at_once_mean_ms", peers.pop(shown), "ms", 10.0, "less", 1, peers,
                  note=f"{shown.rpartition('_')[2]} topics of 200 Hz each way")  # fmt: skip


def under_stress(
    seed: int, seconds: float, passes: int, beside: Sequence[str] = BESIDE
) -> Iterator[Row]:
    """Latency with a busy program on every core."""
    found = sessions(seed, seconds, passes, stress=True, of=(*beside, "direct"))
    means = {
        name: median(_ms(each.forward.true_s, np.mean) for each in of) for name, of in found.items()
    }
    stds = {
        f"{name}_std": median(_ms(each.forward.true_s, np.std) for each in of)
        for name, of in found.items()
    }
    if "direct" in means:
        yield Row("direct_under_stress_mean_ms", means.pop("direct"), "ms", 3.0, "less",
                  len(found["direct"]), means | stds)  # fmt: skip


def correction(seed: int, runs: int) -> Row:
    """A control loop that knows the age of its measurements, compared with one that does not."""
    mean_s, seconds = 0.03, 3.0
    rms = {
        corrected: control.rms_mv(seed, mean_s, seconds, runs, corrected=corrected)
        for corrected in (True, False)
    }
    return Row("loop_error_corrected_ratio", rms[True] / rms[False], "", 0.7, "less", runs,
               {"corrected_mv": rms[True], "uncorrected_mv": rms[False]},
               note=f"one-way latency {1e3 * mean_s:g} ms on average")  # fmt: skip


def _corrected(one: Direction) -> np.ndarray:
    """Corrected latencies; true ones if the paper's filter never converged."""
    return one.corrected_s if np.isfinite(one.corrected_s).any() else one.true_s


def _ms(values: np.ndarray, of: object) -> float:
    return float(1e3 * of(values)) if len(values) else float("nan")  # type: ignore[operator]


def _us(errors_s: np.ndarray) -> float:
    return float(1e6 * np.sqrt(np.mean(np.square(errors_s)))) if len(errors_s) else float("nan")


def _p99(values: np.ndarray) -> float:
    return float(np.quantile(values, 0.99))
