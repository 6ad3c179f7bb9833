"""Fig. 19 (bandwidth), Table V (recovery), and the waiting time of an urgent message."""

from typing import NamedTuple

import numpy as np

from benchmarks.flows import Flow, Times, Trace
from benchmarks.pound.ours import Air, Sent, prepare, run
from sdrlinkd.link import TopicPolicy

SIZES = tuple(1024 << i for i in range(7))
OFFERED_MBPS = 6.5
OUTAGE_S = 5.0
FRESH_S = 0.01
FRESH_IMAGE_S = 0.12
BULK_BYTES = 10_000_000
URGENT_BYTES = 16
SLACK_RT_MS = 1.0
_KINDS = {"laser": (1024, 0.02, "latency"), "image": (65536, 0.15, "bulk")}


def bandwidth(size: int, seconds: float, seed: int) -> float:
    """Mbit/s of messages of `size` that arrive while more is offered than fits."""
    period_s = 8e-6 * size / OFFERED_MBPS
    flow = Flow("bulk", size, period_s, int(seconds / period_s), "bulk")
    (trace,) = run([Sent(flow, 1, 2)], Air(), seed).traces
    heard = np.sort(trace.heard_at[~np.isnan(trace.heard_at)])
    # From the first to the last message, while the queue is never empty.
    busy = heard[heard <= seconds]
    return 8e-6 * size * (len(busy) - 1) / float(busy[-1] - busy[0])


class Recovery(NamedTuple):
    """Time in s from the end of the outage until messages are fresh again, in each trial."""

    lasers_s: list[float]
    images_s: list[float]


def recovery(seed: int, quick: bool) -> Recovery:
    """Two lasers (Table V), and laser and camera; the sender's radio is gone for 5 s.

    Newer messages replace older ones. The time is that of the first message younger than 10 ms
    (image: 120 ms) after which all are.
    """
    rng = np.random.default_rng(seed)
    found = Recovery([], [])
    for trial in range(1 if quick else 10):
        lasers = _after_outage(["laser_0", "laser_1"], rng, seed + trial)
        found.lasers_s.append(max(lasers.values()))
        found.images_s.append(_after_outage(["laser_0", "image"], rng, seed + trial)["image"])
    return found


def _after_outage(names: list[str], rng: np.random.Generator, seed: int) -> dict[str, float]:
    begin = 1.0 + float(rng.uniform(0, 0.15))
    end = begin + OUTAGE_S
    seconds = end + 2.0
    sent = []
    for name in names:
        size, period_s, qos = _KINDS[name.split("_")[0]]
        phase_s = float(rng.uniform(0, period_s))
        sent.append(
            Sent(Flow(name, size, period_s, int(seconds / period_s), qos, 0, 0, phase_s), 1, 2)
        )
    experiment = prepare(sent, Air(), seed, latest_wins)
    simulation = experiment.simulation
    simulation.call(begin, lambda: simulation.silence(1, end))
    return {
        trace.flow.name: _fresh_again(
            trace, end, FRESH_S if trace.flow.size == 1024 else FRESH_IMAGE_S
        )
        for trace in experiment.finish()
    }


def latest_wins(flow: Flow) -> TopicPolicy:
    return TopicPolicy(qos=flow.qos, depth=1)  # type: ignore[arg-type]


def _fresh_again(trace: Trace, end: float, limit_s: float) -> float:
    sent, heard = trace.sent_at, trace.heard_at
    came = ~np.isnan(heard) & (heard > end)
    stale = heard[came & (heard - sent > limit_s)]
    fresh = heard[came & (heard - sent <= limit_s)]
    later = fresh[fresh > stale.max()] if len(stale) else fresh
    return float(later.min() - end) if len(later) else float("inf")


def urgent_waits_ms(seed: int, quick: bool) -> tuple[Times, float, float]:
    """(ages of urgent messages at random times while 10 MB wait, own airtime, the bound) in ms."""
    air = Air()
    seconds = 6.0 if quick else 13.0
    bulk = Flow("bulk", 50_000, 1e-5, BULK_BYTES // 50_000, "bulk")
    rng = np.random.default_rng(seed)
    n = int(seconds * 20)
    stop = Flow("stop", URGENT_BYTES, seconds / n, n, "urgent", jitter_s=seconds / n)
    experiment = prepare(
        [Sent(stop._replace(phase_s=float(rng.uniform(0.01, 0.02))), 1, 2), Sent(bulk, 1, 2)],
        air, seed,
    )  # fmt: skip
    traces = experiment.finish(seconds)
    ages = 1e3 * (traces[0].heard_at - traces[0].sent_at)
    return ages[~np.isnan(ages)], 1e3 * experiment.own_s, 1e3 * air.classes.bulk.max_burst_s
