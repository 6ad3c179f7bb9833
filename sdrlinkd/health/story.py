"""Log lines on what has changed from one snapshot to the next."""

from collections.abc import Iterator, Sequence
from enum import IntEnum
from typing import NamedTuple

from sdrlinkd.health.lately import Lately, shed_by_topic
from sdrlinkd.health.verdict import is_away, is_silent, other_links
from sdrlinkd.health.words import pdu_link_name, span
from sdrlinkd.reports import NeighborReport, Snapshot, TopicReport

BEGINNING = 20
"""Characters of a sentence by which those on one robot are limited, whatever it claims to be."""


class Level(IntEnum):
    """Urgency of a line, as the logging module numbers it."""

    INFO = 20
    WARNING = 30
    ERROR = 40


class Line(NamedTuple):
    """A log line for people about `subject`."""

    subject: str
    level: Level
    text: str


class Story:
    """Compares each snapshot with what was logged about earlier ones."""

    def __init__(self) -> None:
        self._state = ""
        self._away_at: float | None = None
        self._was_up = False
        self._robots: dict[int, NeighborReport] = {}
        self._silent: set[int] = set()
        self._lowest: set[int] = set()
        self._shedding_at: float | None = None
        self._shed_before = 0
        self._is_shed_by_traffic = True
        self._losing_at: float | None = None
        self._steps = 0
        self._replaced: set[str] = set()
        self._unbelieved: set[str] = set()

    def tell(self, snapshot: Snapshot, lately: Lately) -> Iterator[Line]:
        """Log lines on what is new in a snapshot."""
        yield from self._radio(snapshot)
        for robot in snapshot.link.neighbors:
            if not robot.is_self:
                yield from self._robot(robot, snapshot)
        strangers = snapshot.link.security.strangers
        yield from self._strangers([*strangers, *other_links(snapshot, lately)])
        yield from self._queue(snapshot, lately)
        yield from self._samples(snapshot, lately)
        yield from self._replacing(snapshot.link.topics)
        if snapshot.host_clock_steps > self._steps:
            yield Line("host clock", Level.WARNING, "this host's clock was stepped")
        self._steps = snapshot.host_clock_steps

    def _strangers(self, sentences: Sequence[str]) -> Iterator[Line]:
        """A line for each robot that is heard and not believed, as it becomes so."""
        for sentence in sentences:
            if sentence not in self._unbelieved:
                yield Line(sentence[:BEGINNING], Level.WARNING, sentence)
        self._unbelieved = set(sentences)

    def _replacing(self, topics: Sequence[TopicReport]) -> Iterator[Line]:
        """A line for each topic on its first messages that newer ones replaced."""
        for topic in topics:
            n = topic.dropped.get("tx_superseded", 0)
            if n and topic.name not in self._replaced:
                self._replaced.add(topic.name)
                text = (
                    f"{topic.name}: newer messages replace those that wait, {n} so far; this is "
                    f"said once, `sdrlinkctl why {topic.name}` tells the depth and the number"
                )
                yield Line(topic.name, Level.INFO, text)

    def _radio(self, snapshot: Snapshot) -> Iterator[Line]:
        pdu_link, now = snapshot.carrier, snapshot.uptime_s
        name, state = pdu_link_name(pdu_link), pdu_link.state
        if state == self._state or (state == "down" and not is_away(pdu_link)):
            return
        self._state = state
        if state == "up":
            away = "" if self._away_at is None else f" after {span(now - self._away_at)}"
            word = "back" if self._was_up else "up"
            self._was_up, self._away_at = True, None
            yield Line("radio", Level.INFO, f"the {name} is {word}{away}: {pdu_link.detail}")
            return
        if self._away_at is None:
            self._away_at = max(0.0, now - pdu_link.since_s)
        if state == "waiting":
            yield Line("radio", Level.WARNING, f"no {name}, still trying: {pdu_link.reason}")
        elif state == "refused":
            yield Line(
                "radio",
                Level.ERROR,
                f"the {name} refuses the settings: {pdu_link.reason}. The daemon retries after a "
                "reload (SIGHUP)" + (" or when it is plugged in again" if name == "radio" else ""),
            )
        elif state == "ended":
            yield Line("radio", Level.INFO, f"the {name} has ended")
        elif state == "down" and pdu_link.kind == "loopback":
            yield Line("radio", Level.WARNING, "the loopback stands still: the CPU is too slow")
        elif self._was_up:
            yield Line("radio", Level.WARNING, f"the {name} is gone: {pdu_link.reason}")
        elif state == "down":
            yield Line("radio", Level.WARNING, f"no {name} yet: {pdu_link.reason}")

    def _robot(self, robot: NeighborReport, snapshot: Snapshot) -> Iterator[Line]:
        src, subject = robot.src, f"robot {robot.src}"
        before = self._robots.get(src)
        self._robots[src] = robot
        snr = "" if robot.snr_db is None else f" at {robot.snr_db:.0f} dB"
        if before is None:
            yield Line(subject, Level.INFO, f"robot {src} is heard{snr}")
        if is_silent(robot) and src not in self._silent:
            self._silent.add(src)
            ago = span(robot.last_heard_s_ago)
            yield Line(subject, Level.WARNING, f"robot {src} is lost: not heard for {ago}")
        elif src in self._silent and not is_silent(robot):
            self._silent.remove(src)
            yield Line(subject, Level.INFO, f"robot {src} is heard again{snr}")
        if before is not None and robot.reboots > before.reboots:
            yield Line(subject, Level.INFO, f"robot {src} has restarted")
        yield from self._registry(robot, before, snapshot)
        yield from self._mcs(robot, snapshot)
        known = before.clock if before is not None else None
        if known and robot.clock and robot.clock.steps > known.steps:
            yield Line(f"{subject}'s clock", Level.WARNING, f"robot {src}'s clock jumped")

    def _registry(
        self, robot: NeighborReport, before: NeighborReport | None, snapshot: Snapshot
    ) -> Iterator[Line]:
        src, was = robot.src, "unknown" if before is None else before.registry
        if robot.registry == was:
            return
        subject = f"robot {src}'s registry"
        if robot.registry == "differs":
            where = [
                each for each in snapshot.notices if each.startswith(f"robot {src} has a diff")
            ]
            text = where[0] if where else f"robot {src} has a different registry"
            yield Line(subject, Level.WARNING, text)
        elif was == "differs":
            yield Line(subject, Level.INFO, f"robot {src} has the same registry now")

    def _mcs(self, robot: NeighborReport, snapshot: Snapshot) -> Iterator[Line]:
        src, lowest = robot.src, snapshot.link.mcs_lowest
        subject = f"MCS to robot {src}"
        if lowest is None or robot.snr_there_db is None:
            return
        if robot.mcs <= lowest and src not in self._lowest:
            self._lowest.add(src)
            hears = f": it hears us at {robot.snr_there_db:.0f} dB"
            text = f"the MCS to robot {src} fell to {robot.mcs}, the lowest{hears}"
            yield Line(subject, Level.WARNING, text)
        elif robot.mcs > lowest and src in self._lowest:
            self._lowest.remove(src)
            yield Line(subject, Level.INFO, f"the MCS to robot {src} rose again to {robot.mcs}")

    def _queue(self, snapshot: Snapshot, lately: Lately) -> Iterator[Line]:
        shed, now = lately.shed(snapshot), snapshot.uptime_s
        total = sum(shed_by_topic(snapshot).values())
        if shed and self._shedding_at is None:
            self._shedding_at = now
            self._shed_before = total - sum(shed.values())
            worst = next(iter(shed))
            # Without a radio, messages expire whatever the traffic.
            self._is_shed_by_traffic = snapshot.carrier.state == "up"
            text = f"messages are dropped, most of {worst}; sdrlinkctl why {worst} says more"
            if self._is_shed_by_traffic:
                text = f"traffic exceeds the channel capacity: {text}"
            else:
                text = f"there is no {pdu_link_name(snapshot.carrier)}: {text}"
            yield Line("queue", Level.WARNING, text)
        elif not shed and self._shedding_at is not None:
            lasted, dropped = span(now - self._shedding_at), total - self._shed_before
            self._shedding_at = None
            over = (
                "traffic fits the channel again"
                if self._is_shed_by_traffic
                else "messages expire no more"
            )
            text = f"{over}: {dropped} messages dropped in {lasted}"
            yield Line("queue", Level.INFO, text)

    def _samples(self, snapshot: Snapshot, lately: Lately) -> Iterator[Line]:
        lost, now = lately.grown(snapshot, "samples_lost"), snapshot.uptime_s
        if lost > 0 and self._losing_at is None:
            self._losing_at = now
            text = f"the receiver drops samples ({lost} so far): the CPU is too slow"
            yield Line("samples", Level.WARNING, text)
        elif lost <= 0 and self._losing_at is not None:
            lasted, self._losing_at = span(now - self._losing_at), None
            yield Line("samples", Level.INFO, f"the receiver keeps up again, after {lasted}")
