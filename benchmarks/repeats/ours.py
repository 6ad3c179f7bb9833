"""Two real links on an air that only one of them uses at a time, and that loses PDUs."""

from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random

from benchmarks.repeats.losses import Losses
from sdrlinkd.link import (
    AS_CONFIGURED,
    AccessParams,
    Burst,
    ClassesParams,
    ClockParams,
    Link,
    LinkParams,
    Opportunity,
    Outcome,
    Overrides,
    PduLinkTraits,
    QueueParams,
    RateParams,
    ReassemblyParams,
    RepeatParams,
    UrgentParams,
)
from sdrlinkd.wire import make_registry

PDU_SIZE = 256
PDU_S, PREAMBLE_S = 1.6e-3, 4e-4
"""Airtime of a PDU of QPSK 1/2 at 1 Msps, and of preamble and header."""
STEP_S = 5e-4
TIMER_S = 0.05
TURN_S = 2e-4
"""Pause between two bursts."""
START_S = 3.0
"""Time in s before the first message: the robots meet."""
SOURCE, SINK = 1, 2


@dataclass
class Traffic:
    """Messages of `size` bytes every `period_s`, `n` of them."""

    n: int
    period_s: float
    size: int
    overrides: Overrides = AS_CONFIGURED


@dataclass
class Outcomes:
    """What became of a run's messages: how long each took in s, by its number; and the airtime."""

    n: int
    took_s: dict[int, float] = field(default_factory=dict)
    air_share: float = 0.0
    """Share of the time in which the source sent."""
    repeats_share: float = 0.0
    """Share of the time for what was sent again."""

    def within(self, limit_s: float) -> float:
        """Share of the messages that took at most `limit_s`, in %."""
        return 100 * sum(took_s <= limit_s for took_s in self.took_s.values()) / self.n


class Pair:
    """A source and a sink; `lost(at)` says whether a PDU is lost, for each burst from its start."""

    def __init__(
        self, traffic: Traffic, losses: Losses, seed: int, *, share: float = 0.05,
        twice: bool = False, by_burst: bool = False,
    ) -> None:  # fmt: skip
        self._traffic = traffic
        self._losses = losses
        self._by_burst = by_burst
        self._links = {each: _link(each, share, twice, seed) for each in (SOURCE, SINK)}
        self._sent_at: dict[int, float] = {}
        self._free_at = 0.0
        self._on_air: list[tuple[float, Callable[[], None]]] = []
        self.outcomes = Outcomes(traffic.n)

    def run(self) -> Outcomes:
        """Run until all messages had a second more."""
        traffic, source = self._traffic, self._links[SOURCE]
        end_s = START_S + traffic.n * traffic.period_s + 2.0
        number, timers_at, step = 0, 0.0, 0
        while (now := step * STEP_S) < end_s:
            step += 1
            while number < traffic.n and now >= START_S + number * traffic.period_s:
                payload = b"\0\1\0\0" + number.to_bytes(4, "little") + bytes(traffic.size - 8)
                self._sent_at[number] = now
                source.submit(0, payload, now, traffic.overrides)
                number += 1
            while self._on_air and self._on_air[0][0] <= now:
                self._on_air.pop(0)[1]()
            if now >= timers_at:
                timers_at += TIMER_S
                for link in self._links.values():
                    link.handle_timers(now)
            self._look(now, step)
        report = source.report(end_s)
        self.outcomes.air_share = report.airtime_s / end_s
        self.outcomes.repeats_share = report.repeats.airtime_s / end_s
        return self.outcomes

    def _look(self, now: float, step: int) -> None:
        """Let one of the links send if nobody does; they take turns at being asked first."""
        if now < self._free_at:
            return
        for node in (SOURCE, SINK) if step % 2 else (SINK, SOURCE):
            burst = self._links[node].next_burst(Opportunity(now, _airtime_s, _most_pdus))
            if burst is not None:
                self._send(node, burst)
                return

    def _send(self, node: int, burst: Burst) -> None:
        end = burst.start + burst.airtime_s
        self._free_at = end + TURN_S
        lost_all = self._losses(burst.start) if self._by_burst else False
        arrives = [
            pdu
            for i, pdu in enumerate(burst.pdus)
            if not (lost_all if self._by_burst else self._losses(burst.start + _middle_s(i)))
        ]

        def over() -> None:
            self._links[node].confirm(burst, Outcome.SENT, end)
            other = self._links[SINK if node == SOURCE else SOURCE]
            for pdu in arrives:
                for message in other.hear(pdu, burst.start, 20.0, end, end):
                    self._took(message.payload, end)

        self._on_air.append((end, over))

    def _took(self, payload: bytes, at: float) -> None:
        number = int.from_bytes(payload[4:8], "little")
        if number in self.outcomes.took_s:
            raise RuntimeError(f"message {number} came twice")
        self.outcomes.took_s[number] = at - self._sent_at[number]


def _link(own_id: int, share: float, twice: bool, seed: int) -> Link:
    link = Link(
        LinkParams(pdu_size=PDU_SIZE), QueueParams(), ReassemblyParams(),
        make_registry([("odom", "nav_msgs/Odometry")]), own_id, Random(10 * seed + own_id),
        classes=ClassesParams(urgent=UrgentParams(twice=twice)), clock=ClockParams(),
        repeat=RepeatParams(share=share),
    )  # fmt: skip
    lengths = (_airtime_s(0, 8),), (_airtime_s(0, 1),)
    traits = PduLinkTraits(longest_burst_s=lengths[0], pdu_burst_s=lengths[1])
    link.attach(traits, AccessParams(policy="none"), RateParams())
    return link


def _airtime_s(_mcs: int, n_pdus: int) -> float:
    return PREAMBLE_S + n_pdus * PDU_S


def _most_pdus(_mcs: int, airtime_s: float) -> int:
    return int(min(8, max(0.0, (airtime_s - PREAMBLE_S) / PDU_S + 1e-6)))


def _middle_s(number: int) -> float:
    return PREAMBLE_S + (number + 0.5) * PDU_S
