"""Latencies of messages at their handover, and topics that fall silent."""

from typing import NamedTuple

from sdrlinkd.link.queue import TopicPolicy
from sdrlinkd.link.receive.deadman import Deadman
from sdrlinkd.link.receive.delivered import Delivered
from sdrlinkd.link.receive.latency import Latency
from sdrlinkd.reports import LatencyReport
from sdrlinkd.wire import Waits


class AgeReport(NamedTuple):
    """How late messages of one topic from one source arrived; None: no STAMP came.

    `stops` is the number of stop messages published because the topic fell silent for `deadman_s`.
    """

    last_ms: float | None = None
    p50_ms: float | None = None
    p99_ms: float | None = None
    latency: LatencyReport | None = None
    stops: int = 0
    deadman_s: float = 0.0


class Handover:
    """Latencies and dead-man timers, by (source, topic id)."""

    def __init__(self) -> None:
        self._latencies: dict[tuple[int, int], Latency] = {}
        self._waits: dict[tuple[int, int], Waits] = {}
        """Why messages waited at their source, as the source reports."""
        self._deadman = Deadman()
        self._deadman_s: dict[tuple[int, int], float] = {}
        """The times of the dead-man timers that messages have set."""
        self._commands: dict[tuple[int, str], tuple[int, int]] = {}
        """From where the last message of a command topic came, by whose topic it is."""

    def deliver(self, message: Delivered, policy: TopicPolicy, now: float) -> float | None:
        """Note that `message` is handed over at `now`; returns its age in s, None if unknown."""
        key = message.src, message.topic_id
        if policy.deadman_s:
            self._deadman.fresh(*key, now, policy.deadman_s)
            self._deadman_s[key] = policy.deadman_s
            # What comes from a robot itself and over gateways is one stream of commands.
            whose = message.topic.origin(message.src), message.topic.at_origin
            before = self._commands.setdefault(whose, key)
            if before != key:
                self._deadman.disarm(*before)
                self._commands[whose] = key
        if message.origin_at is None:
            return None
        latency = self._latencies.get(key)
        if latency is None:
            latency = self._latencies[key] = Latency()
        return latency.add(message.parts(now), now)

    def take_waits(self, src: int, waits: Waits) -> None:
        """Remember the WAITS record of robot `src` on one of its topics."""
        self._waits[src, waits.topic_id] = waits

    @property
    def silence_at(self) -> float:
        """Time in s at which the next command topic falls silent unless a message arrives."""
        return self._deadman.next_at

    def take_silent(self, now: float) -> list[tuple[int, int]]:
        """(source, topic id) of command topics that fell silent, each once."""
        return self._deadman.take_due(now)

    def forget(self, topic_id: int) -> None:
        """Disarm a topic's dead-man timers, as its policy has none any more."""
        self._deadman.forget(topic_id)
        for key in [key for key in self._deadman_s if key[1] == topic_id]:
            del self._deadman_s[key]

    def report(self, src: int, topic_id: int) -> AgeReport:
        """How late messages of a topic from robot `src` arrived, and why."""
        key = src, topic_id
        stops, deadman_s = self._deadman.stops.get(key, 0), self._deadman_s.get(key, 0.0)
        latency = self._latencies.get(key)
        if latency is None:
            return AgeReport(stops=stops, deadman_s=deadman_s)
        return AgeReport(
            latency.last_ms(),
            latency.quantile_ms(0.5),
            latency.quantile_ms(0.99),
            _latency_report(latency, self._waits.get(key)),
            stops,
            deadman_s,
        )


def _latency_report(latency: Latency, waits: Waits | None) -> LatencyReport:
    parts, period = latency.parts(), latency.period_ms()
    wait_ms = 1e3 * parts.wait_s
    split = {}
    if waits is not None and (whole := sum(waits[1:])):
        names = ("queue_ms", "access_ms", "again_ms")
        split = {n: wait_ms * share / whole for n, share in zip(names, waits[1:], strict=True)}
    return LatencyReport(
        wait_ms=wait_ms,
        reassembly_ms=1e3 * parts.reassembly_s,
        air_ms=1e3 * parts.air_s,
        handover_ms=1e3 * parts.handover_s,
        period_ms=period[0] if period else None,
        jitter_ms=period[1] if period else None,
        percentiles_ms=latency.percentiles_ms(),
        **split,
    )
