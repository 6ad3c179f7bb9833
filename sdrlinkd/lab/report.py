"""report.json of a lab run: what each robot received from each other, and the airtime it took."""

import math
from collections.abc import Mapping, Sequence

from msgspec import Struct

from sdrlinkd.demo import Pair, Sample, Trace, latency_ms
from sdrlinkd.reports import Snapshot

TENTHS = 10


class PairResult(Struct, frozen=True, kw_only=True):
    """What one robot received from another."""

    sender: int
    receiver: int
    sent: int
    received: int
    pdr: float
    pdr_tenths: list[float | None]
    """PDR in each tenth of the run, by the time of sending; null: nothing was sent."""
    latency_ms: dict[str, float]
    bytes_identical: bool
    topics: dict[str, list[int]]
    """[sent, received] messages, by topic name."""


class RobotResult(Struct, frozen=True, kw_only=True):
    """What one robot's daemon did in an experiment."""

    id: int
    carrier: str
    access: str
    airtime_share: float
    bursts_by_mcs: dict[int, int]
    mcs_changes: list[tuple[float, int, int]]
    """Changes of the MCS, as (time in s, neighbor, new MCS)."""
    snr_db: dict[int, float]
    """Last SNR in dB at which it heard each other robot."""
    bursts_sent: int
    bursts_failed: int
    bursts_late: int
    pdus_sent: int
    pdus_heard: int
    pdus_bad: int
    headers_bad: int
    samples_lost: int
    hub_outages: int
    dropped: dict[str, int]
    left: int
    """Messages that were not sent by the end of the run."""
    ledger_adds_up: bool


class LabReport(Struct, frozen=True, kw_only=True):
    """One run of a scenario. In lock-step, the same seed gives the same report to the byte."""

    scenario: str
    title: str
    pace: str
    seed: int
    duration_s: float
    source: str
    pdr: float
    """PDR of all pairs together, 0 to 1."""
    worst_pdr: float
    robots: list[RobotResult]
    pairs: list[PairResult]
    out_of_reach: list[tuple[int, int]]
    """(sender, receiver) pairs that never hear each other in the scenario; not in any PDR."""
    damage: str


def pair_result(
    sender: int, receiver: int, trace: Trace, began_at: float, duration_s: float
) -> PairResult:
    """The figures of one direction between two robots."""
    pairs, foreign = trace.matches()
    flat = [pair for found in pairs.values() for pair in found]
    received, sent = len(flat), trace.n_sent
    told = [pair for pair in flat if math.isfinite(pair[1].at)]
    return PairResult(
        sender=sender,
        receiver=receiver,
        sent=sent,
        received=received,
        pdr=received / sent if sent else 1.0,
        pdr_tenths=_tenths(trace.sent, flat, began_at, duration_s),
        latency_ms={name: round(value, 4) for name, value in latency_ms(told).items()},
        bytes_identical=foreign == 0 and received == trace.n_received,
        topics={
            name: [len(samples), len(pairs.get(name, []))]
            for name, samples in sorted(trace.sent.items())
        },
    )


def robot_result(snapshot: Snapshot, problems: Sequence[str], until_s: float) -> RobotResult:
    """The figures of one robot, from its daemon's snapshot."""
    link, counters = snapshot.link, snapshot.carrier.counters
    pdus = {k: v for k, v in link.rx.pdus_dropped.items() if k not in ("rx_control", "rx_dup")}
    dropped = {**link.tx.dropped, **link.rx.dropped, **pdus}
    return RobotResult(
        id=snapshot.node,
        carrier=snapshot.carrier.detail,
        access=link.access,
        airtime_share=round(link.airtime_s / until_s, 6),
        bursts_by_mcs=link.bursts_by_mcs,
        mcs_changes=[(round(at, 6), node, mcs) for at, node, mcs in link.mcs_changes],
        snr_db={
            each.src: round(each.snr_db, 2) for each in link.neighbors if each.snr_db is not None
        },
        bursts_sent=link.tx.bursts_sent,
        bursts_failed=link.tx.bursts_failed,
        bursts_late=link.bursts_late,
        pdus_sent=link.tx.pdus_sent,
        pdus_heard=link.rx.pdus_heard,
        pdus_bad=counters["pdus_bad"],
        headers_bad=counters["headers_bad"],
        samples_lost=counters["samples_lost"],
        hub_outages=counters["hub_outages"],
        dropped=dict(sorted(dropped.items())),
        left=link.tx.queued + link.tx.in_flight,
        ledger_adds_up=not problems,
    )


def _tenths(
    sent: Mapping[str, Sequence[Sample]],
    pairs: Sequence[Pair],
    began_at: float,
    duration_s: float,
) -> list[float | None]:
    n_sent, n_received = [0] * TENTHS, [0] * TENTHS

    def tenth(sample: Sample) -> int:
        return min(max(int((sample.at - began_at) / duration_s * TENTHS), 0), TENTHS - 1)

    for samples in sent.values():
        for sample in samples:
            n_sent[tenth(sample)] += 1
    for was, _ in pairs:
        n_received[tenth(was)] += 1
    return [round(got / of, 4) if of else None for got, of in zip(n_received, n_sent, strict=True)]
