"""Reads a drive into what its report is made of."""

import struct
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
from mcap.exceptions import McapError
from mcap.reader import make_reader

from sdrlinkd.adapters import PLACES, Fix, Place, read_place
from sdrlinkd.drive.names import DRIVE, STATUS, Event, read_passage, read_report
from sdrlinkd.errors import CdrError, UserError
from sdrlinkd.over_time import figures_of, is_later
from sdrlinkd.reports import ReceivedTopicReport, Snapshot

_status = msgspec.json.Decoder(Snapshot).decode
_event = msgspec.json.Decoder(Event).decode
NO_DRIVE = "allowed: a drive that `sdrlinkctl log` made, or its folder"


@dataclass
class Delivery:
    """Messages of one topic of a robot at another one, over all starts of its daemon."""

    delivered: int = 0
    lost: int = 0
    """Dropped here; what never came is not among them."""
    age_ms_p50: float | None = None
    age_ms_p99: float | None = None


@dataclass
class Station:
    """What one daemon reported over the drive; times in s from the drive's begin."""

    robot: int
    times: list[float] = field(default_factory=list)
    levels: list[str] = field(default_factory=list)
    """The verdict at each time."""
    reasons: list[str] = field(default_factory=list)
    """The worst reason at each time; empty: OK."""
    lines: dict[str, dict[str, list[float | None]]] = field(default_factory=dict)
    """Figures by picture and name, one for each time."""
    deliveries: dict[tuple[int, str], Delivery] = field(default_factory=dict)
    """By source and topic."""
    accepted: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    """Messages that its own programs published, by topic."""
    dropped: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    """Messages dropped by name in the ledger, in all."""
    last: Snapshot | None = None


@dataclass
class Drive:
    """A whole drive."""

    path: Path
    begin_ns: int = 0
    end_ns: int = 0
    stations: dict[int, Station] = field(default_factory=dict)
    events: list[tuple[float, Event]] = field(default_factory=list)
    paths: dict[tuple[int, int | None], list[tuple[float, float]]] = field(default_factory=dict)
    """Places in m by (robot, who received them or None for as published)."""

    def pdr(self, at: int, source: int, topic: str) -> float:
        """Share of a robot's messages that another one delivered.

        Of those that it published, where its own daemon is in the drive; else of those that began
        to arrive.
        """
        found = self.stations[at].deliveries[source, topic]
        whole = found.delivered + found.lost
        if source in self.stations:
            whole = max(whole, self.stations[source].accepted.get(topic, 0))
        return found.delivered / max(1, whole)

    @property
    def lasted_s(self) -> float:
        """Length in s."""
        return (self.end_ns - self.begin_ns) / 1e9


def read_drive(path: Path) -> Drive:
    """Read a drive's file, or that in a folder. Raises UserError."""
    path = path / DRIVE if path.is_dir() else path
    drive = Drive(path)
    try:
        with path.open("rb") as file:
            for topic, time_ns, kind, data in _messages(file):
                drive.begin_ns = drive.begin_ns or time_ns
                drive.end_ns = max(drive.end_ns, time_ns)
                _take(drive, topic, (time_ns - drive.begin_ns) / 1e9, kind, data)
    except OSError as error:
        raise UserError(f"{path}: {error.strerror}; {NO_DRIVE}") from None
    except (McapError, msgspec.MsgspecError, ValueError, struct.error, MemoryError) as error:
        raise UserError(f"{path}: cannot be read ({error}); {NO_DRIVE}") from None
    if not drive.stations:
        raise UserError(f"{path}: has no report of a daemon; {NO_DRIVE}")
    for station in drive.stations.values():
        if station.last is not None:
            _add_up(station, station.last)
    return drive


def _messages(file: object) -> Iterator[tuple[str, int, str, bytes]]:
    """(topic, time in ns, type, octets) of each message, in the order of times."""
    for schema, channel, message in make_reader(file).iter_messages():  # type: ignore[arg-type]
        yield channel.topic, message.log_time, schema.name if schema else "", message.data


def _take(drive: Drive, topic: str, at_s: float, kind: str, data: bytes) -> None:
    report = read_report(topic)
    if report is not None and report[1] == STATUS:
        robot = report[0]
        _note(drive.stations.setdefault(robot, Station(robot)), _status(data), at_s)
    elif report is not None:
        drive.events.append((at_s, _event(data)))
    elif kind in PLACES and (passage := read_passage(topic)) is not None:
        try:
            found = read_place(passage.robot, kind, data)
        except CdrError:
            return
        if isinstance(found, Place):
            points = drive.paths.setdefault((passage.robot, passage.at), [])
            points.append(found.position[:2])
        elif isinstance(found, Fix):
            return  # A picture in m has no place for degrees.


def _note(station: Station, snapshot: Snapshot, at_s: float) -> None:
    before = station.last
    is_same = before is not None and is_later(snapshot, before)
    if before is not None and not is_same:
        _add_up(station, before)
    station.last = snapshot
    n = len(station.times)
    station.times.append(at_s)
    station.levels.append(snapshot.verdict.level)
    station.reasons.append(next(iter(snapshot.verdict.reasons), ""))
    for picture, values in figures_of(snapshot, before if is_same else None).items():
        lines = station.lines.setdefault(picture, {})
        for name in values:
            lines.setdefault(name, [None] * n)
        for name, line in lines.items():
            line.append(values.get(name))


def _add_up(station: Station, last: Snapshot) -> None:
    """Add the last counters of one start of a daemon."""
    for each in last.link.received:
        _deliver(station, each)
    for own in last.link.topics:
        if own.accepted:
            # On the air and at others, a topic has no namespace.
            name = own.name.removeprefix(f"/{last.namespace.strip('/')}")
            station.accepted[name] += own.accepted
    for ledger in (last.link.tx, last.link.rx):
        for name, n in ledger.dropped.items():
            if n:
                station.dropped[name] += n


def _deliver(station: Station, topic: ReceivedTopicReport) -> None:
    key = topic.src, topic.name
    known = station.deliveries.setdefault(key, Delivery())
    known.delivered += topic.delivered
    known.lost += sum(topic.dropped.values())
    known.age_ms_p50 = topic.age_ms_p50 if topic.age_ms_p50 is not None else known.age_ms_p50
    known.age_ms_p99 = topic.age_ms_p99 if topic.age_ms_p99 is not None else known.age_ms_p99
