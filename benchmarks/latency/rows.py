"""Rows: the paper's Table 3 as an emulation, and the quality of clocks and ages."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from statistics import median

import numpy as np

from benchmarks.absent import attempt
from benchmarks.latency import airtime, clocks, lockstep, loop
from benchmarks.latency.control import Knows
from benchmarks.latency.correction import Direction
from benchmarks.latency.session import Session, run
from benchmarks.peers.latency.table import PEERS
from benchmarks.report import Row
from sdrlinkd.config import ModemParams
from sdrlinkd.modem import Airtimes

OURS = ("line", "direct", "ether")
TOLD = ("mavlink", "mavros", "xrce", *OURS)
BESIDE = ("mavlink", "xrce")
"""Peers that are also measured under stress and with more topics."""
PAPER_MS = {
    ("xrce", "fwd"): (1.329, 0.162),
    ("xrce", "bwd"): (1.752, 0.315),
    ("mavros", "fwd"): (1.678, 0.560),
    ("mavros", "bwd"): (2.133, 1.020),
}
"""Table 3: mean and standard deviation; its MAVLink is the one with MAVROS.

MAVROS' figures are the target of `line`: the line alone takes longer for a PDU than XRCE's mean.
"""
SIZE = 115
PERIOD_MS = 5.0
"""Between two messages of a topic."""
SHARE_PCT = 2.0
LOOP_S = 6.0
KNOWS: tuple[Knows, ...] = ("age", "mean", "nothing")


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
    """Mean and standard deviation each way of true latencies, as medians of the passes.

    `on_the_line` is the part of the mean that the line takes for one message. Where the paper's
    filter converged, the means by its correction stand beside them.
    """
    for name, passes in found.items():
        for way in ("fwd", "bwd"):
            each = [ways(session)[way] for session in passes]
            n = sum(one.n_heard for one in each)
            peers = {
                "p50": median(_ms(one.true_s, np.median) for one in each),
                "p99": median(_ms(one.true_s, _p99) for one in each),
                "lost": float(sum(one.n_sent - one.n_heard for one in each)),
                **_corrected(each),
            }
            if (line_s := PEERS[name].on_the_line_s(SIZE)) is not None:
                peers["on_the_line"] = 1e3 * line_s
            paper = PAPER_MS.get((name, way), (None, None))
            target = PAPER_MS["mavros", way] if name == "line" else (None, None)
            for what, of, number in (("mean", np.mean, 0), ("std", np.std, 1)):
                value = median(_ms(one.true_s, of) for one in each)
                yield Row(f"{name}_115B_200hz_{what}_ms_{way}", value, "ms", target[number],
                          "less", n, peers if what == "mean" else {},
                          paper=paper[number], includes=PEERS[name].of)  # fmt: skip


def _corrected(each: Sequence[Direction]) -> dict[str, float]:
    """Latencies as the paper corrects them, without those before its filter converged."""
    known = [one.corrected_s[np.isfinite(one.corrected_s)] for one in each]
    n_known, n = sum(map(len, known)), sum(one.n_heard for one in each)
    found = {"corrected_pct": 100 * n_known / max(1, n)}
    if n_known:
        found["corrected_mean"] = median(_ms(one, np.mean) for one in known if len(one))
        found["filter_error_us"] = median(
            _us(one.filter_error_s) for one in each if len(one.filter_error_s)
        )
    return found


def load(found: dict[str, list[Session]]) -> Iterator[Row]:
    """CPU time and memory of all programs, without the emulated line, which stands for hardware."""
    for what, unit in (("cpu_share", "cores"), ("rss_mib", "MiB")):
        peers = {
            name: median(
                sum(value for process, value in getattr(each, what).items() if process != "line")
                for each in passes
            )
            for name, passes in found.items()
        }
        if "line" in peers:
            yield Row(f"line_{what}", peers.pop("line"), unit, None, "less", len(found["line"]),
                      peers, includes=PEERS["line"].of)  # fmt: skip


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
              n, {"mean": float(late_ms.mean()), "airtime": 1e3 * found.airtime_s},
              exact=True)  # fmt: skip
    yield Row("age_rms_us_lockstep", _us(found.age_errors_s), "µs", 20.0, "less", n, exact=True)


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
        yield Row(name, found.control_pct, "%", SHARE_PCT, "less", round(seconds), peers,
                  exact=True)  # fmt: skip


def more_topics(
    seed: int, seconds: float, quick: bool, beside: Sequence[str] = BESIDE
) -> Iterator[Row]:
    """The paper's future work: latency with more topics, 200 Hz each.

    Four topics are more than the line carries, whatever the system.
    """
    peers: dict[str, float] = {}
    for n_topics in (2,) if quick else (2, 4, 7):
        for name, each in sessions(
            seed, seconds, 1, n_topics=n_topics, of=(*beside, "line", "direct")
        ).items():
            peers[f"{name}_{n_topics}"] = _ms(each[0].forward.true_s, np.mean)
            peers[f"{name}_{n_topics}_lost_pct"] = 100 * (
                1 - each[0].forward.n_heard / max(1, each[0].forward.n_sent)
            )
    if "line_2" in peers:
        yield Row("line_topics_at_once_mean_ms", peers.pop("line_2"), "ms", PERIOD_MS, "less", 1,
                  peers, note="2 topics of 200 Hz each way",
                  includes=PEERS["line"].of)  # fmt: skip


def under_stress(
    seed: int, seconds: float, passes: int, beside: Sequence[str] = BESIDE
) -> Iterator[Row]:
    """Latency with a busy program on every core."""
    found = sessions(seed, seconds, passes, stress=True, of=(*beside, "line", "direct"))
    means = {
        name: median(_ms(each.forward.true_s, np.mean) for each in of) for name, of in found.items()
    }
    stds = {
        f"{name}_std": median(_ms(each.forward.true_s, np.std) for each in of)
        for name, of in found.items()
    }
    if "line" in means:
        yield Row("line_under_stress_mean_ms", means.pop("line"), "ms", 3.0, "less",
                  len(found["line"]), means | stds, includes=PEERS["line"].of)  # fmt: skip


def corrections(seed: int, runs: int) -> Iterator[Row]:
    """A control loop whose controller knows the ages of its inputs, over one that does not."""
    for name, case, target in (
        ("loop_error_corrected_ratio", loop.OLD, 0.7),
        ("loop_error_corrected_ratio_fresh", loop.FRESH, None),
    ):
        found = {
            knows: [loop.run_loop(case, knows, seed + i, LOOP_S) for i in range(runs)]
            for knows in KNOWS
        }
        rms_v = {knows: np.array([_rms(run.error_v) for run in of]) for knows, of in found.items()}
        own, ignored = rms_v["age"], rms_v["nothing"]
        inputs_s, answers_s = (
            np.concatenate([getattr(run, ages) for run in found["age"]])
            for ages in ("inputs_s", "answers_s")
        )
        peers = {
            "corrected_mv": 1e3 * _rms(own),
            "ages_ignored_mv": 1e3 * _rms(ignored),
            "mean_age_only_mv": 1e3 * _rms(rms_v["mean"]),
            "worst_ratio": float((own / ignored).max()),
            "input_age_ms": _ms(inputs_s, np.mean),
            "input_age_std_ms": _ms(inputs_s, np.std),
            "answer_age_ms": _ms(answers_s, np.mean),
            "answer_age_std_ms": _ms(answers_s, np.std),
        }
        yield Row(name, _rms(own) / _rms(ignored), "", target, "less", runs, peers, exact=True,
                  note=f"{loop.ROBOTS} robots, {case.policy}, {case.rate_hz / 1e6:g} Msps",
                  )  # fmt: skip


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _ms(values: np.ndarray, of: object) -> float:
    return float(1e3 * of(values)) if len(values) else float("nan")  # type: ignore[operator]


def _us(errors_s: np.ndarray) -> float:
    return float(1e6 * np.sqrt(np.mean(np.square(errors_s)))) if len(errors_s) else float("nan")


def _p99(values: np.ndarray) -> float:
    return float(np.quantile(values, 0.99))
