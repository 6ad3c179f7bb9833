"""The laser and the camera in real time, on this machine.

Measures one daemon whose radio hears itself, and two daemons with the hub of their air, which are
three programs on the same cores.
"""

import statistics
import threading
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from backends import HubWatch
from benchmarks.absent import attempt
from benchmarks.flows import Flow, Times, Trace, figures
from benchmarks.pound.limits import BULK_BYTES, FRESH_IMAGE_S, FRESH_S, OUTAGE_S, SLACK_RT_MS
from benchmarks.pound.ours import CDR, MCS, PDU_SIZE, Air, modem_on
from benchmarks.pound.programs import BULK_BURST_S, Ends, running
from benchmarks.report import Row
from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.modem import Airtimes

PASSES = 3
DRAIN_S = 2.0
BETWEEN_S = 9.5
"""Time from the start of one outage to the start of the next."""
BEFORE_S = 1.5
SLEEPS = 500


def rows(seed: int, quick: bool) -> Iterator[Row]:
    """The rows with a target in real time: medians of several passes.

    Daemons that do not start, or end, cost their own rows only.
    """
    outages = [(i * BETWEEN_S, i * BETWEEN_S + OUTAGE_S) for i in range(1, 30)]
    recovered: list[Row] = []
    beside: dict[str, float] = {}
    passes: list[list[Row]] = []
    with attempt("two daemons and an outage"), running("ether", (1, 2), outages) as ends:
        recovered = _recovery(ends, seed, outages, 1 if quick else 4)
    with attempt("two daemons and a hub"), running("ether", (1, 2)) as ends:
        beside = {row.name: row.value for row in table_rows(ends, seed, quick)}
    with attempt("a daemon that hears itself"), running("loopback", (1,)) as ends:
        for i in range(1 if quick else PASSES):
            lateness = _lateness()
            made = [*table_rows(ends, seed + i, quick), *limit_rows(ends, seed + i, quick)]
            made[0] = replace(made[0], note=f"{made[0].note}; {lateness}")
            passes.append(made)
    for row in [_median_of(rows) for rows in zip(*passes, strict=True)]:
        if row.name in beside:
            row.peers["two daemons and a hub"] = beside[row.name]
        yield row
    yield from recovered


def _median_of(rows: Sequence[Row]) -> Row:
    """The median of one row over several passes."""
    values = [row.value for row in rows]
    note = "; ".join(filter(None, (row.note for row in rows)))
    if len(rows) > 1:
        note = f"passes {', '.join(f'{value:.4g}' for value in values)}; {note}"
    value, trials = statistics.median(values), sum(row.trials for row in rows)
    return replace(rows[0], value=value, trials=trials, note=note)


def _lateness() -> str:
    """How late this machine wakes a sleeping thread."""
    late_ms = []
    for _ in range(SLEEPS):
        began = time.monotonic()
        time.sleep(1e-3)
        late_ms.append(1e3 * (time.monotonic() - began) - 1)
    median, p99 = np.quantile(late_ms, [0.5, 0.99])
    return f"sleeps on this machine end {median:.2f} ms late, p99 {p99:.1f} ms"


def _recovery(
    ends: Ends, seed: int, outages: Sequence[tuple[float, float]], trials: int
) -> list[Row]:
    """Table V with two daemons: the air vanishes for 5 s without notice."""
    rng = np.random.default_rng(seed)
    lasers, images = [], []
    for _ in range(trials):
        with HubWatch(ends.air) as watch:
            now_s = watch.ask().now_s
        origin = time.monotonic() - now_s
        begin, end = next(each for each in outages if each[0] > now_s + BEFORE_S + 0.5)
        time.sleep(begin - now_s - BEFORE_S)
        seconds = BEFORE_S + OUTAGE_S + 2
        flows = [
            Flow("laser", 1024, 0.02, int(seconds / 0.02), phase_s=rng.uniform(0, 0.02)),
            Flow("image", 65536, 0.15, int(seconds / 0.15), phase_s=rng.uniform(0, 0.15)),
        ]
        traces, began = _play(ends, flows, seed)
        lasers.append(_fresh_after(traces[0], origin + end - began, FRESH_S))
        images.append(_fresh_after(traces[1], origin + end - began, FRESH_IMAGE_S))
    note = "two daemons and a hub, with an outage of the air"
    return [
        Row("recovery_after_5s_outage_s_rt", max(lasers), "s", 0.2, "less", trials, note=note),
        Row("recovery_after_5s_outage_image_s_rt", float(np.mean(images)), "s", 0.5, "less",
            trials, note=f"{note}; at worst {max(images):.3f} s"),
    ]  # fmt: skip


def _fresh_after(trace: Trace, end: float, limit_s: float) -> float:
    """Time from `end` to the first message younger than `limit_s`."""
    ages = trace.heard_at - trace.sent_at
    fresh = trace.heard_at[(trace.heard_at > end) & (ages <= limit_s)]
    return float(fresh.min() - end) if len(fresh) else float("inf")


def table_rows(ends: Ends, seed: int, quick: bool) -> list[Row]:
    n = 100 if quick else 1000
    rng = np.random.default_rng(seed)
    flows = [
        Flow("laser", 1024, 0.02, n, phase_s=rng.uniform(0, 0.02)),
        Flow("image", 65536, 0.15, int(n * 0.02 / 0.15), phase_s=rng.uniform(0, 0.15)),
    ]
    traces, _ = _play(ends, flows, seed)
    laser, image = (figures(trace) for trace in traces)
    p99 = 1e3 * float(np.nanquantile(traces[0].heard_at - traces[0].sent_at, 0.99))
    note = f"laser p50 {1e3 * _median(traces[0]):.2f} ms, p99 {p99:.2f} ms"
    return [
        Row("laser_2n_D_ms_rt", laser.d_ms, "ms", 3.5, "less", n, paper=4.1, note=note),
        Row("laser_2n_stdD_ms_rt", laser.std_d_ms, "ms", 1.0, "less", n, paper=4.0),
        Row("laser_2n_stdJd_ms_rt", laser.std_jd_ms, "ms", 1.3, "less", n, paper=2.0),
        Row("image_2n_D_ms_rt", image.d_ms, "ms", 108, "less", flows[1].count, paper=112.0),
        Row("image_2n_stdD_ms_rt", image.std_d_ms, "ms", 3, "less", flows[1].count, paper=1.9),
        Row("mdr_2n_laser_pct_rt", laser.mdr_pct, "%", 100, "more", n, paper=99.8),
        Row("mdr_2n_image_pct_rt", image.mdr_pct, "%", 100, "more", flows[1].count, paper=99.9),
    ]


def limit_rows(ends: Ends, seed: int, quick: bool) -> list[Row]:
    """Bandwidth, and urgent messages while 10 MB wait."""
    rng = np.random.default_rng(seed)
    seconds = 1.0 if quick else 8.0
    offered = 8e-6 * 65536 / 6.5
    (bulk,), _ = _play(ends, [Flow("image", 65536, offered, int(seconds / offered))], seed)
    heard = np.sort(bulk.heard_at[~np.isnan(bulk.heard_at)])
    heard = heard[heard < seconds]
    mbps = 8e-6 * 65536 * (len(heard) - 1) / float(heard[-1] - heard[0])
    n = 15 if quick else 150
    length_s = n / 20
    n_bulk = int(min(BULK_BYTES, length_s * 5.5e6 / 8) / 50_000)
    stop = Flow("stop", 16, length_s / n, n, jitter_s=0.02, phase_s=0.3 + rng.uniform(0, 0.01))
    traces, _ = _play(ends, [stop, Flow("image", 50_000, 1e-4, n_bulk)], seed)
    ages = 1e3 * (traces[0].heard_at - traces[0].sent_at)
    own_ms = 1e3 * Airtimes(modem_on(Air()), PDU_SIZE).airtime_s(MCS, 1)
    return [
        Row("user_mbps_64KB_of_6.0_rt", mbps, "Mbit/s", 5.5, "more", len(heard), paper=5.1),
        Row("urgent_p99_ms_rt", float(np.nanquantile(ages, 0.99)), "ms",
            1e3 * BULK_BURST_S + own_ms + SLACK_RT_MS, "less", n,
            {"p50": float(np.nanmedian(ages))}),
    ]  # fmt: skip


def _median(trace: Trace) -> float:
    return float(np.nanmedian(trace.heard_at - trace.sent_at))


def _play(ends: Ends, flows: list[Flow], seed: int) -> tuple[list[Trace], float]:
    """Publish at robot 1 on an exact schedule, listen at robot 2; also returns the start time."""
    rng = np.random.default_rng(seed)
    times = [flow.times(rng) for flow in flows]
    heard: dict[str, Times] = {flow.name: np.full(flow.count, np.nan) for flow in flows}
    began = [0.0]
    ended = threading.Event()

    def listen(ready: threading.Event) -> None:
        with Subscriber(*[f"/rx_robot_1/{f.name}" for f in flows], runtime_dir=ends.hears) as ear:
            ready.set()
            while not ended.is_set():
                message = ear.receive(0.2)
                if message is not None:
                    at = time.monotonic()
                    number = int.from_bytes(message.payload[4:8], "little")
                    heard[message.topic.rsplit("/", 1)[-1]][number] = at - began[0]

    ready = threading.Event()
    listener = threading.Thread(target=listen, args=(ready,), daemon=True)
    listener.start()
    ready.wait(10)
    due = sorted((float(at), i, n) for i, of in enumerate(times) for n, at in enumerate(of))
    sent = [np.full(flow.count, np.nan) for flow in flows]
    with Publisher(ends.sends) as out:
        began[0] = time.monotonic() + 0.3
        for at, i, n in due:
            _sleep_until(began[0] + at)
            payload = CDR + n.to_bytes(4, "little") + bytes(flows[i].size)
            sent[i][n] = at
            out.send(f"/robot_1/{flows[i].name}", payload)
        time.sleep(DRAIN_S)
    ended.set()
    listener.join()
    traces = [Trace(flow, at, heard[flow.name]) for flow, at in zip(flows, sent, strict=True)]
    return traces, began[0]


def _sleep_until(at: float) -> None:
    while (left := at - time.monotonic()) > 0:
        time.sleep(max(0.0, left - 2e-4) if left > 4e-4 else 0.0)
