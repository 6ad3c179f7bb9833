"""report.json of a lab run: what each robot received from each other, and the airtime it took."""

import math
from collections.abc import Callable, Sequence

from msgspec import Struct

from sdrlinkd.demo import Sample, Trace, latency_ms
from sdrlinkd.lab.over_time import ClassOverTime, Clock, Passage, Values, hops_over_time
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
    hops: Values = []
    """Mean number of hops in each of 40 parts of the run, by the time of sending; null: nothing
    came. Only where robots relay."""


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
    classes: list[ClassOverTime] = []
    """Delivery and delay of each class, in 40 parts of the run."""


def pair_result(
    sender: int, receiver: int, trace: Trace, clock: Clock, hop_limit: int | None,
    counts: Callable[[Sample], bool],
) -> tuple[PairResult, list[Passage]]:  # fmt: skip
    """The figures of one direction between two robots, and its messages by topic.

    `counts` says of each sent message whether it could come. `hop_limit` None: nobody relays.
    """
    found, foreign = trace.matches()
    n_matched = sum(map(len, found.values()))
    passages = [
        Passage(
            topic=name,
            sent=[each for each in samples if counts(each)],
            pairs=[each for each in found.get(name, []) if counts(each[0])],
        )
        for name, samples in sorted(trace.sent.items())
    ]
    flat = [pair for passage in passages for pair in passage.pairs]
    received, sent = len(flat), sum(len(passage.sent) for passage in passages)
    told = [pair for pair in flat if math.isfinite(pair[1].at)]
    result = PairResult(
        sender=sender,
        receiver=receiver,
        sent=sent,
        received=received,
        pdr=received / sent if sent else 1.0,
        pdr_tenths=_tenths(passages, clock),
        latency_ms={name: round(value, 4) for name, value in latency_ms(told).items()},
        bytes_identical=foreign == 0 and n_matched == trace.n_received,
        topics={each.topic: [len(each.sent), len(each.pairs)] for each in passages},
        hops=[] if hop_limit is None else hops_over_time(flat, clock, hop_limit),
    )
    return result, passages


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


def _tenths(passages: Sequence[Passage], clock: Clock) -> list[float | None]:
    n_sent, n_received = [0] * TENTHS, [0] * TENTHS
    for passage in passages:
        for sample in passage.sent:
            n_sent[clock.part(sample, TENTHS)] += 1
        for was, _ in passage.pairs:
            n_received[clock.part(was, TENTHS)] += 1
    return [round(got / of, 4) if of else None for got, of in zip(n_received, n_sent, strict=True)]
