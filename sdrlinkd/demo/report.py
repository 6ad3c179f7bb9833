"""report.json: the measurements of one demonstration."""

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from sdrlinkd.demo.links import Options
from sdrlinkd.demo.load import Load
from sdrlinkd.demo.source import Source
from sdrlinkd.demo.trace import Pair, Trace, goodput_bytes_per_s, latencies_s, path_error_m
from sdrlinkd.reports import Snapshot

QUANTILES = {"p50": 0.50, "p90": 0.90, "p99": 0.99}


class TopicResult(Struct, frozen=True, kw_only=True):
    """The results of one topic in one run."""

    name: str
    type: str
    sent: int
    received: int
    pdr: float
    goodput_bytes_per_s: float
    latency_ms: dict[str, float]
    path_error_m: float | None = None


class PhyResult(Struct, frozen=True, kw_only=True):
    """The modem's settings, and its receiver's counters."""

    mcs: str
    mcs_index: int
    rate_hz: float
    channel: str
    snr_db: float
    clock_ppm: float
    bursts: int
    pdus_good: int
    pdus_bad: int
    headers_bad: int
    samples_lost: int
    """Samples lost because the receiver did not keep up."""
    snr_db_measured: float | None
    realtime_ratio: float | None
    busy: float | None = None
    """Share of the time in which the daemon's busiest thread ran or waited for a CPU."""
    waited: float | None = None
    """Share of the time in which that thread waited because other programs had the CPUs."""


class RunResult(Struct, frozen=True, kw_only=True):
    """The results of one run: a link, a source, and the measurements."""

    name: str
    source: str
    seed: int
    pdu_size: int
    duration_s: float
    sent: int
    received: int
    pdr: float
    goodput_bytes_per_s: float
    latency_ms: dict[str, float]
    path_error_m: float | None
    bytes_identical: bool
    entries_per_message: float
    pdus_sent: int
    ledger_adds_up: bool
    dropped: dict[str, int]
    topics: list[TopicResult]
    left_out: list[str]
    damage: str
    phy: PhyResult | None = None


class DemoReport(Struct, frozen=True, kw_only=True):
    """The results of all runs of one call."""

    version: str
    runs: list[RunResult]


def latency_ms(pairs: Sequence[Pair]) -> dict[str, float]:
    """Quantiles of the end-to-end latency in ms; empty if nothing arrived."""
    ordered = latencies_s(pairs) * 1e3
    if not len(ordered):
        return {}
    quantiles = {name: float(np.quantile(ordered, q)) for name, q in QUANTILES.items()}
    return {**quantiles, "max": float(ordered[-1])}


def topic_results(trace: Trace) -> list[TopicResult]:
    """The results of each topic, in order of names."""
    pairs, _ = trace.matches()
    results = []
    for name in sorted(trace.sent):
        sent, matched = trace.sent[name], pairs.get(name, [])
        error = None
        if name in trace.odometry_topics():
            got = [sample for _, sample in matched]
            error = path_error_m(trace.path(sent), trace.path(got))
        results.append(
            TopicResult(
                name=name,
                type=trace.types[name],
                sent=len(sent),
                received=len(matched),
                pdr=len(matched) / len(sent) if sent else 0.0,
                goodput_bytes_per_s=goodput_bytes_per_s(matched),
                latency_ms=latency_ms(matched),
                path_error_m=error,
            )
        )
    return results


def run_result(
    trace: Trace,
    *,
    source: Source,
    options: Options,
    duration_s: float,
    pdus_sent: int,
    entries: int,
    dropped: dict[str, int],
    ledger_adds_up: bool,
    phy: PhyResult | None = None,
) -> RunResult:
    """The results of a finished run."""
    pairs, foreign = trace.matches()
    topics = topic_results(trace)
    errors = [topic.path_error_m for topic in topics if topic.path_error_m is not None]
    flat = [pair for found in pairs.values() for pair in found]
    received = len(flat)
    return RunResult(
        name=options.link,
        source=source.title,
        seed=options.seed,
        pdu_size=options.pdu_size,
        duration_s=duration_s,
        sent=trace.n_sent,
        received=received,
        pdr=received / trace.n_sent if trace.n_sent else 0.0,
        goodput_bytes_per_s=goodput_bytes_per_s(flat),
        latency_ms=latency_ms(flat),
        path_error_m=max(errors) if errors else None,
        bytes_identical=foreign == 0 and received == trace.n_received and received > 0,
        entries_per_message=entries / trace.n_sent if trace.n_sent else 0.0,
        pdus_sent=pdus_sent,
        ledger_adds_up=ledger_adds_up,
        dropped=dropped,
        topics=topics,
        left_out=source.left_out,
        damage=source.recording.damage,
        phy=phy,
    )


def phy_result(options: Options, receiver: Snapshot, load: Load | None) -> PhyResult:
    """The counters of the receiving node's modem, and its load if it ran in real time."""
    counters = receiver.carrier.counters
    snr = [each.snr_db for each in receiver.link.neighbors if each.snr_db is not None]
    return PhyResult(
        mcs=receiver.carrier.detail.split(",")[0],
        mcs_index=options.mcs,
        rate_hz=options.rate_hz,
        channel=options.channel,
        snr_db=options.snr_db,
        clock_ppm=options.clock_ppm,
        bursts=counters["bursts"],
        pdus_good=counters["pdus_good"],
        pdus_bad=counters["pdus_bad"],
        headers_bad=counters["headers_bad"],
        samples_lost=counters.get("samples_lost", 0),
        snr_db_measured=snr[0] if snr else None,
        realtime_ratio=receiver.carrier.realtime_ratio,
        busy=None if load is None else round(load.busy, 3),
        waited=None if load is None else round(load.waited, 3),
    )
