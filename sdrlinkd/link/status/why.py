"""Explains what happens to a topic's messages, in plain sentences."""

from collections.abc import Callable, Collection, Hashable, Iterable
from math import inf
from typing import NamedTuple

from sdrlinkd.link.access import idle_words
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import TX_REASONS, Intake, Outbox, TopicPolicy
from sdrlinkd.link.status.meters import RateMeter
from sdrlinkd.link.transmit import TransmitReport
from sdrlinkd.reports import RepeatReport
from sdrlinkd.wire import BROADCAST

MINUTE_S = 60.0
STEP_S = 2.0
FULL = 0.85
"""Share of airtime from which the channel counts as full; policies leave about the rest idle."""
OVERFLOW = (
    "tx_overflow_old", "tx_overflow_new", "tx_topic_full", "tx_superseded", "tx_expired",
    "tx_too_slow",
)  # fmt: skip
"""Reasons of drops that more airtime would have prevented."""


class Told(NamedTuple):
    """Where a policy comes from: the file, the keys that were set since, the QoS that its producer
    offers, in words, and the message type, if a key is by it.
    """

    source: str
    changed: Collection[str]
    offered: str = ""
    by_type: str = ""


class AirUse(NamedTuple):
    """Use of the channel since the start: our report, and the airtime of others' bursts in s.

    `repeats` is our report on what was sent again.
    """

    sent: TransmitReport
    heard_s: float
    repeats: RepeatReport = RepeatReport()


class Why:
    """Explains a topic from the counters of the last minute, of topics and channel."""

    def __init__(self, intake: Intake, outbox: Outbox) -> None:
        self._intake = intake
        self._outbox = outbox
        self._began_at = float("inf")
        self._meter = RateMeter(MINUTE_S, STEP_S)

    def sample(self, now: float, topics: Iterable[int], air: Callable[[], AirUse]) -> None:
        """Sample all counters at `now`, if the last sample is some seconds old.

        `topics` are the ids of all topics.
        """
        self._began_at = min(self._began_at, now)
        if self._meter.is_due(now):
            self._meter.sample(self._counters(topics, air()), now)

    def explain(self, topic_id: int, name: str, told: Told, now: float, air: AirUse) -> list[str]:
        """What happens to a topic's messages and why, in plain sentences."""
        policy, tally = self._intake.policy(topic_id), self._intake.tally(topic_id)
        came = self._lately(("accepted", topic_id), tally.accepted, now)
        sent = self._lately(("sent", topic_id), tally.sent, now)
        lines = [self._treatment(name, policy, told, topic_id), *self._commands(topic_id)]
        if not came:
            lines.append(
                "no local program sent a message in the last minute"
                if tally.accepted
                else "no local program has sent a message yet"
            )
        else:
            lines.append(f"last minute: {came} messages in, {sent} sent ({_share(sent, came)})")
        short = False
        for reason, total in sorted(tally.dropped.items(), key=lambda each: -each[1]):
            n = self._lately(("drop", topic_id, reason), total, now)
            if n:
                short = short or reason in OVERFLOW
                said = self._said(reason, topic_id, policy, told)
                lines.append(f"{_share(n, came)} {said} ({reason}, {n})")
        waiting = self._outbox.queued_of_topic(topic_id)
        if waiting:
            lines.append(f"{waiting} queued")
        if short or waiting:
            lines.append(self._air(self._intake.treatment(topic_id)[0], now, air))
            lines += self._idle(now, air)
        return [*lines, *self._again(now, air)]

    def _treatment(self, name: str, policy: TopicPolicy, told: Told, topic_id: int) -> str:
        dst = self._intake.destination(topic_id)
        to = "everyone" if dst == BROADCAST else f"robot {dst}"
        line = f"{name}: class {policy.qos}, priority {policy.priority}, to {to}"
        if policy.weight != 1:
            line += f", weight {policy.weight:g}"
        if policy.kept:
            line += f", depth {policy.kept}"
        lifespan = self._intake.lifespan(topic_id)
        if lifespan.source:
            line += f", lifespan {_seconds(lifespan.seconds)}"
            if lifespan.source == "class":
                line += " from its class"
        if policy.compress != "none":
            line += f", compressed with {policy.compress}"
        if policy.durability == "transient_local":
            n = policy.latched
            line += f", last {'message' if n == 1 else f'{n} messages'} kept for late joiners"
        by_type = f"by its type {told.by_type}" if told.by_type else ""
        by = f"set while running: {', '.join(sorted(told.changed))}" if told.changed else ""
        offered = f"the producer's offer: {told.offered}" if told.offered else ""
        return f"{line} ({'; '.join(each for each in (told.source, by_type, offered, by) if each)})"

    def _commands(self, topic_id: int) -> list[str]:
        """A sentence on messages to one robot, if they are treated otherwise."""
        policy, command = self._intake.policy(topic_id), self._intake.command(topic_id)
        if (command.qos, command.lifespan_s) == (policy.qos, policy.lifespan_s):
            return []
        lives = "" if command.lifespan_s is None else f", lifespan {_seconds(command.lifespan_s)}"
        stops = f", dead-man after {_seconds(command.deadman_s)}" if command.deadman_s else ""
        return [f"sent to one robot: class {command.qos}{lives}{stops}"]

    def _said(self, reason: str, topic_id: int, policy: TopicPolicy, told: Told) -> str:
        if reason == "tx_throttled":
            enough_s = self._intake.enough_s(topic_id)
            if enough_s > policy.period_s:
                return f"throttled to {1 / enough_s:.3g} Hz, which the robots that want it ask for"
            if not policy.period_s:
                return "throttled by a period that is no longer set"
            by = "sdrlinkctl set" if "period_s" in told.changed else told.source
            return f"throttled to {1 / policy.period_s:.3g} Hz by {by}"
        if reason == "tx_superseded":
            if not policy.kept:
                return "replaced by newer ones, by a depth that is no longer set"
            return f"replaced by newer ones: depth {policy.kept}"
        if reason == "tx_expired":
            return self._too_old(topic_id, policy)
        if reason == "tx_too_slow":
            needs = 8e-6 * self._intake.needed_bytes_per_s(topic_id)
            return (
                "refused: a command that cannot arrive within its lifespan; the last one needs "
                f"{needs:.3g} Mbit/s"
            )
        if reason in ("tx_overflow_old", "tx_overflow_new", "tx_topic_full"):
            return f"shed: {TX_REASONS[reason]}"
        return f"dropped: {TX_REASONS[reason]}"

    def _too_old(self, topic_id: int, policy: TopicPolicy) -> str:
        lifespan = self._intake.lifespan(topic_id)
        if not lifespan.source:
            # Each message says it itself.
            return "expired in the queue: older than their producer allows"
        of_class = lifespan.source == "class"
        whose = f", the lifespan of class {policy.qos}" if of_class else ""
        return f"expired in the queue: older than {_seconds(lifespan.seconds)}{whose}"

    def _air(self, qos: Qos, now: float, air: AirUse) -> str:
        used = {
            each: self._lately(("air", each), round(1e6 * used_s), now)
            for each, used_s in air.sent.used_s.items()
        }
        total = sum(used.values())
        rate = air.sent.bytes_per_s * 8e-6
        carries = f"; a full channel carries {rate:.3g} Mbit/s" if rate < inf else ""
        if not total:
            return f"nothing was sent in the last minute{carries}"
        shares = [f"{each.label} {_share(n, total)}" for each, n in used.items() if n]
        if not used[qos]:
            shares.insert(0, f"{qos.label} none")
        return f"this robot's own airtime: {', '.join(shares)}{carries}"

    def _idle(self, now: float, air: AirUse) -> list[str]:
        """A sentence on how busy the channel was, or why it was idle."""
        over_s = min(MINUTE_S, now - self._began_at)
        if over_s <= 0:
            return []
        sent, heard = (
            1e-6 * self._lately(("air", each), round(1e6 * used_s), now) / over_s
            for each, used_s in _both(air).items()
        )
        busy = min(1.0, sent + heard)
        words = idle_words(air.sent.settled, 1 - busy)
        if words is None:
            words = f"the channel was {'full' if busy > FULL else f'{100 * busy:.0f} % busy'}"
        return [f"{words} (ours {100 * min(1.0, sent):.0f} %, others' {100 * heard:.0f} %)"]

    def _again(self, now: float, air: AirUse) -> list[str]:
        """A sentence on the PDUs that were sent again, if there were any."""
        pdus = self._lately(("repeats", "pdus"), air.repeats.pdus, now)
        over_s = min(MINUTE_S, now - self._began_at)
        if not pdus or over_s <= 0:
            return []
        used = self._lately(("repeats", "air"), round(1e6 * air.repeats.airtime_s), now)
        share = 1e-4 * used / over_s
        return [f"{pdus} PDUs of all topics were lost and sent again, in {share:.2g} % of the air"]

    def _lately(self, key: Hashable, value: int, now: float) -> int:
        return self._meter.grown(key, value, now)

    def _counters(self, topics: Iterable[int], air: AirUse) -> dict[Hashable, int]:
        counters: dict[Hashable, int] = {
            ("air", qos): round(1e6 * used_s) for qos, used_s in air.sent.used_s.items()
        }
        for each, used_s in _both(air).items():
            counters["air", each] = round(1e6 * used_s)
        counters["repeats", "pdus"] = air.repeats.pdus
        counters["repeats", "air"] = round(1e6 * air.repeats.airtime_s)
        for topic_id in topics:
            tally = self._intake.tally(topic_id)
            counters["accepted", topic_id] = tally.accepted
            counters["sent", topic_id] = tally.sent
            for reason, n in tally.dropped.items():
                counters["drop", topic_id, reason] = n
        return counters


def _both(air: AirUse) -> dict[str, float]:
    """Airtime in s so far: ours (`sent`) and that of others (`heard`)."""
    return {"sent": air.sent.airtime_s, "heard": air.heard_s}


def _share(n: int, of: int) -> str:
    return f"{100 * n / max(1, of):.3g} %"


def _seconds(seconds: float) -> str:
    return f"{seconds:g} s" if seconds >= 1 else f"{1e3 * seconds:g} ms"
