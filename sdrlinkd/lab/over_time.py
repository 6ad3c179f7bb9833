"""How delivery, delay and hops went over the time of a run."""

from collections.abc import Iterable, Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from sdrlinkd.demo import Pair, Sample

BINS = 40
"""Number of equal parts of a run."""

Values = list[float | None]


class ClassOverTime(Struct, frozen=True, kw_only=True):
    """Messages of one class in each part of a run, by the time of sending; null: nothing."""

    qos: str
    pdr: Values
    p50_ms: Values
    p99_ms: Values


class Passage(Struct, frozen=True, kw_only=True):
    """What became of the messages of one topic from one robot to another."""

    topic: str
    sent: Sequence[Sample]
    pairs: Sequence[Pair]


class Clock(Struct, frozen=True, kw_only=True):
    """The time of a run: when it began, on the clock of the samples, and how long it took, in s."""

    began_at: float
    duration_s: float

    def part(self, sample: Sample, n: int = BINS) -> int:
        """The part of the run, of `n` equal ones, in which a message was sent."""
        share = (sample.at - self.began_at) / self.duration_s
        return min(max(int(share * n), 0), n - 1)

    def since_begin(self, sample: Sample) -> float:
        """When a message was sent, in s since the begin."""
        return sample.at - self.began_at


def classes_over_time(passages: Iterable[tuple[str, Passage]], clock: Clock) -> list[ClassOverTime]:
    """One entry for each class of (class, messages), the most urgent first."""
    by_class: dict[str, list[Passage]] = {}
    for qos, passage in passages:
        by_class.setdefault(qos, []).append(passage)
    order = ("urgent", "latency", "default", "bulk")
    return [_class_over_time(qos, by_class[qos], clock) for qos in order if qos in by_class]


def _class_over_time(qos: str, passages: Sequence[Passage], clock: Clock) -> ClassOverTime:
    n_sent = [0] * BINS
    delays_s: list[list[float]] = [[] for _ in range(BINS)]
    for passage in passages:
        for sample in passage.sent:
            n_sent[clock.part(sample)] += 1
        for was, got in passage.pairs:
            delays_s[clock.part(was)].append(got.at - was.at)
    return ClassOverTime(
        qos=qos,
        pdr=[
            round(len(each) / n, 4) if n else None for each, n in zip(delays_s, n_sent, strict=True)
        ],
        p50_ms=[_quantile_ms(each, 0.5) for each in delays_s],
        p99_ms=[_quantile_ms(each, 0.99) for each in delays_s],
    )


def _quantile_ms(delays_s: Sequence[float], share: float) -> float | None:
    known = [each for each in delays_s if np.isfinite(each)]
    return round(1e3 * float(np.quantile(known, share)), 4) if known else None


def hops_over_time(pairs: Iterable[Pair], clock: Clock, hop_limit: int) -> Values:
    """Mean number of hops of the messages that came, in each part of a run."""
    hops: list[list[int]] = [[] for _ in range(BINS)]
    for was, got in pairs:
        hops[clock.part(was)].append(hop_limit - got.hops_left + 1)
    return [round(float(np.mean(each)), 2) if each else None for each in hops]


def as_array(values: Values) -> NDArray[np.float64]:
    """Values for a picture; NaN where there is nothing."""
    return np.array([np.nan if each is None else each for each in values], dtype=np.float64)
