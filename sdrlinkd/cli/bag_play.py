"""`bag play`: plays a recording to a running daemon."""

import itertools
import math
import re
import threading
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console, Group
from rich.live import Live
from rich.progress import Progress

from sdrlinkd.adapters import (
    Bag,
    BagMessage,
    BagTopic,
    cdr_from_fields,
    first_seconds,
    from_second,
    open_bag,
    paced,
)
from sdrlinkd.asking import ask_status, snapshot_at
from sdrlinkd.cli.app import RuntimeDir, connect
from sdrlinkd.cli.bag import COLUMNS, bags
from sdrlinkd.client import ControlClient, MessageRefusedError, Publisher, RefusedError
from sdrlinkd.errors import BagError, UserError
from sdrlinkd.health import span
from sdrlinkd.reports import Snapshot
from sdrlinkd.tables import FittedTable, figure, screen_console, words

CLOCK, CLOCK_TYPE = "/clock", "rosgraph_msgs/msg/Clock"
RECEPTIONS = "/link/receptions"
"""What `bag record` notes of each message; nothing to be played."""
SECOND_NS = 1_000_000_000
LOOK_S = 1.0
HEARD = re.compile(r"/rx_robot_(\d+)(/.+)")
"""A topic as `bag record` finds it where another robot hears it."""

Key = tuple[str, str]
"""Name and type of a topic in the bag."""


@bags.command()
def play(
    bag: Annotated[Path, typer.Argument(help="rosbag2 folder, .mcap, .db3 or .bag")],
    rate: Annotated[
        float, typer.Option("--rate", "-r", min=0.001, help="Playback speed; 1: as recorded.")
    ] = 1.0,
    start: Annotated[
        float, typer.Option(min=0, help="Leave out this many seconds at its beginning.")
    ] = 0.0,
    duration: Annotated[
        float | None, typer.Option(min=0.001, help="Play only this many seconds from there.")
    ] = None,
    loop: Annotated[
        bool, typer.Option("--loop", "-l", help="Play it again and again, until Ctrl-C.")
    ] = False,
    clock: Annotated[
        float,
        typer.Option(min=0, max=1000, help="Send the recording's time on /clock, so often a s."),
    ] = 0.0,
    topics: Annotated[
        list[str] | None,
        typer.Option("--topics", help="Play only this topic, or pattern with *; repeatable."),
    ] = None,
    remap: Annotated[
        list[str] | None, typer.Option(help="FROM:=TO: play the bag's FROM as the daemon's TO.")
    ] = None,
    max_gap: Annotated[
        float, typer.Option(min=0.0, help="Longest pause in s; longer ones are shortened to it.")
    ] = 5.0,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Play a recording to the daemon: rosbag2 verbatim, ROS 1 converted.

    Topics that the daemon does not know are declared with their recorded QoS, if it takes them
    (auto = true). What `bag record` heard from another robot, /rx_robot_2/odom, is sent as this
    robot's /odom. The exit code is 1 if a message was refused.
    """
    console = Console(stderr=True)
    opened = open_bag(bag)
    try:
        with connect(runtime_dir) as control:
            before = ask_status(control)
            routes = _routed(opened, before, topics or [], remap or [])
            routes.declare(control)
            clock_topic = _clock_topic(control, before) if clock else ""
        for name, reason in routes.left_out.items():
            console.print(f"left out: {name} ({reason})", style="yellow", markup=False)
        if not routes.to:
            raise UserError(
                f"{bag}: the daemon carries none of its topics; it carries "
                f"{', '.join(_taken(before)) or 'none'}"
            )
        part = _Part(opened, routes, start, duration)
        if loop and not part.n_messages:
            raise UserError(f"{bag}: no messages to play again and again; give another --start")
        played = _Played(routes, clock, clock_topic, runtime_dir, _Dropped(before))
        _play(part, played, rate, max_gap, console, bag.name, loop=loop)
    finally:
        opened.close()
    for line in played.complaints:
        console.print(line, style="yellow", markup=False)
    typer.echo(f"played {sum(played.sent.values())} messages of {bag}")
    if opened.damage:
        raise BagError(opened.damage)
    if played.refused.total():
        raise typer.Exit(1)


@dataclass
class _Routes:
    """Which topics of a bag are played as which of the daemon's, and which are left out."""

    to: dict[Key, str] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    unknown: dict[BagTopic, str] = field(default_factory=dict)
    """Topics that the daemon does not know, and what they would be called there."""

    def declare(self, control: ControlClient) -> None:
        """Have the daemon take what it does not know, with the QoS of the recording."""
        for topic, name in self.unknown.items():
            qos = topic.qos
            arguments: dict[str, bool | int | float | str | bytes | None] = {
                "name": name, "type": topic.type, "reliability": qos.reliability,
                "durability": qos.durability, "depth": qos.depth,
            }  # fmt: skip
            try:
                control.ask("declare", arguments)
            except RefusedError as error:
                self.left_out[topic.name] = str(error)
            else:
                self.to[topic.name, topic.type] = name


class _Part:
    """The messages of a recording to be played: those of routed topics, in a span of time."""

    def __init__(self, bag: Bag, routes: _Routes, start: float, duration: float | None) -> None:
        self._bag, self._to = bag, routes.to
        self._damage = bag.damage
        self._start, self._duration = start, duration
        played = [each for each in bag.topics() if (each.name, each.type) in routes.to]
        self._latched = {
            each.name: max(1, each.qos.depth) for each in played if each.qos.is_latched
        }
        self.n_messages = sum(each.n_messages for each in played)
        if start or duration is not None:
            # Only reading all of them shows how many there are.
            self.n_messages = sum(1 for _ in self.messages())

    @property
    def is_damaged(self) -> bool:
        """Whether damage was found since."""
        return self._bag.damage != self._damage

    def messages(self) -> Iterator[BagMessage]:
        """The messages; those for late joiners that came before the start are the first."""
        played = self._bag.messages()
        if self._start:
            played = from_second(played, self._start, self._latched)
        if self._duration is not None:
            played = first_seconds(played, self._duration)
        return (message for message in played if (message.topic, message.type) in self._to)


class _Dropped:
    """What the daemon drops of its topics after `before`, asked now and then on another thread."""

    def __init__(self, before: Snapshot) -> None:
        self._before = {each.name: Counter(each.dropped) for each in before.link.topics}
        self._now: dict[str, Counter[str]] = {}

    def look(self, snapshot: Snapshot | None) -> None:
        """Note what was dropped so far."""
        if snapshot is not None:
            self._now = {
                each.name: Counter(each.dropped) - self._before.get(each.name, Counter())
                for each in snapshot.link.topics
            }

    def of(self, name: str) -> Counter[str]:
        """Number of messages dropped, by reason."""
        return self._now.get(name, Counter())


class _Played:
    """What was sent and refused so far, by topic of the daemon."""

    def __init__(
        self, routes: _Routes, clock: float, clock_topic: str, runtime_dir: Path | None,
        dropped: _Dropped,
    ) -> None:  # fmt: skip
        self._routes, self.runtime_dir = routes, runtime_dir
        self._clock, self._clock_topic = clock, clock_topic
        self.dropped = dropped
        self.sent: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()
        self._reasons: dict[str, str] = {}
        self._n_pauses, self._longest_s = 0, 0.0
        self._told_ns = -math.inf
        self._began = time.monotonic()

    def send(self, message: BagMessage, publisher: Publisher) -> None:
        """Send a message as the topic that it is routed to."""
        name = self._routes.to[message.topic, message.type]
        if self._clock and not 0 <= message.time_ns - self._told_ns < SECOND_NS / self._clock:
            self._told_ns = message.time_ns
            now = clock_message(message.time_ns)
            self._try(publisher, self._clock_topic, now, CLOCK_TYPE)
        if self._try(publisher, name, message.cdr, message.type):
            self.sent[name] += 1

    def shorten(self, pause_s: float) -> None:
        """Note that a pause of the recording is played as a shorter one."""
        self._n_pauses += 1
        self._longest_s = max(self._longest_s, pause_s)

    def _try(self, publisher: Publisher, name: str, cdr: bytes, kind: str) -> bool:
        try:
            publisher.send(name, cdr, type=kind)
        except MessageRefusedError as error:
            self.refused[name] += 1
            self._reasons.setdefault(name, str(error).removeprefix(f"{name}: "))
            return False
        return True

    def table(self) -> FittedTable:
        """Each topic: what was sent, how often, and what the daemon did not send on."""
        table = FittedTable(
            "",
            (words("topic", least=18), figure("sent"), figure("Hz", 1), figure("refused", 3),
             figure("dropped", 1), words("why", 2)),
        )  # fmt: skip
        lasted_s = max(0.1, time.monotonic() - self._began)
        for name in sorted({*self._routes.to.values()}):
            dropped = self.dropped.of(name)
            table.add(
                name, str(self.sent[name]), f"{self.sent[name] / lasted_s:.1f}",
                str(self.refused[name]), str(dropped.total()),
                ", ".join(f"{reason} {n}" for reason, n in dropped.most_common(2)),
            )  # fmt: skip
        return table

    @property
    def complaints(self) -> Iterator[str]:
        """What did not go as it was recorded, in lines."""
        if n := self._n_pauses:
            pauses = f"{n} pause{'s' if n > 1 else ''} of up to {span(self._longest_s)}"
            yield f"{pauses} shortened: --max-gap"
        for name, n in self.refused.items():
            if n:
                yield f"not sent: {n} messages of {name} ({self._reasons[name]})"


def _play(
    part: _Part, played: _Played, rate: float, max_gap: float, console: Console, name: str, *,
    loop: bool,
) -> None:  # fmt: skip
    """Send the messages at their times; shows progress, rates and losses by topic meanwhile."""
    bar, over = Progress(*COLUMNS, console=console), threading.Event()

    def look() -> None:
        while not over.wait(LOOK_S):
            played.dropped.look(snapshot_at(played.runtime_dir))
            live.update(Group(played.table(), bar))

    looking = threading.Thread(target=look, daemon=True)
    with (
        Publisher(played.runtime_dir) as publisher,
        Live(bar, console=console, refresh_per_second=4, transient=True) as live,
    ):
        looking.start()
        try:
            for _ in itertools.count() if loop else range(1):
                task = bar.add_task(name, total=part.n_messages)
                messages = paced(part.messages(), rate, max_gap_s=max_gap, shortened=played.shorten)
                is_empty = True
                for message in messages:
                    is_empty = False
                    played.send(message, publisher)
                    bar.advance(task)
                bar.remove_task(task)
                if is_empty or part.is_damaged:
                    # It would be read again and again at once.
                    break
        finally:
            over.set()
            looking.join()
            played.dropped.look(snapshot_at(played.runtime_dir))
    screen_console(stderr=True).print(played.table())


def clock_message(time_ns: int) -> bytes:
    """A rosgraph_msgs/Clock as CDR."""
    seconds, ns = divmod(time_ns, SECOND_NS)
    return cdr_from_fields(CLOCK_TYPE, {"clock": {"sec": seconds, "nanosec": ns}}, CLOCK)


def _clock_topic(control: ControlClient, snapshot: Snapshot) -> str:
    """The daemon's topic for the recording's time, which is declared if it has none."""
    own = f"/{snapshot.namespace.strip('/')}{CLOCK}" if snapshot.namespace else CLOCK
    taken = _taken(snapshot)
    known = next((name for name in (CLOCK, own) if name in taken), "")
    if known and taken[known] != CLOCK_TYPE:
        raise UserError(f"--clock: the daemon's {known} is {taken[known]}; allowed: {CLOCK_TYPE}")
    if not known:
        control.ask("declare", {"name": CLOCK, "type": CLOCK_TYPE, "reliability": "best_effort"})
    return known or CLOCK


def _taken(snapshot: Snapshot) -> dict[str, str]:
    """The topics that the daemon takes from the bus, and their types."""
    return {topic.name: topic.type for topic in snapshot.link.topics if topic.subscribed}


def _routed(bag: Bag, snapshot: Snapshot, only: list[str], remap: list[str]) -> _Routes:
    """Where each topic of the bag goes. Raises UserError."""
    mapping = {}
    for rule in remap:
        source, separator, target = rule.partition(":=")
        if not separator:
            raise UserError(f"--remap: got {rule!r}; allowed: /from:=/to")
        mapping[_absolute(source)] = target
    only = [_absolute(name) for name in only]
    topics, taken = bag.topics(), _taken(snapshot)
    known = {topic.name for topic in topics}
    for name in (*only, *mapping):
        if not any(fnmatchcase(each, name) for each in known):
            raise UserError(f"got {name}; allowed: the bag's topics {', '.join(sorted(known))}")
    chosen = [
        each
        for each in topics
        if any(fnmatchcase(each.name, one) for one in only)
        or (not only and each.name != RECEPTIONS)
    ]
    found = _Routes(left_out={name: f"{what} messages" for name, what in bag.skipped.items()})
    heard_from = _robots_heard(chosen)
    for topic in chosen:
        candidates = [mapping.get(topic.name, topic.name)]
        if topic.name not in mapping:
            heard = HEARD.fullmatch(topic.name)
            own, robots = (topic.name, []) if heard is None else (heard[2], heard_from[heard[2]])
            if len(robots) > 1 and topic.name not in taken:
                told = " and ".join(map(str, robots))
                pattern = f"/rx_robot_{robots[0]}/*"
                found.left_out[topic.name] = (
                    f"heard from robots {told}; choose one, as with --topics '{pattern}'"
                )
                continue
            if snapshot.namespace and not own.startswith(f"/{snapshot.namespace.strip('/')}/"):
                own = f"/{snapshot.namespace.strip('/')}{own}"
            candidates.append(own)
        target = next((name for name in candidates if name in taken), "")
        if not target:
            found.unknown[topic] = candidates[-1]
        elif taken[target] != topic.type:
            found.left_out[topic.name] = (
                f"its type is {topic.type}; the daemon carries {taken[target]} there"
            )
        else:
            found.to[topic.name, topic.type] = target
    return found


def _robots_heard(topics: list[BagTopic]) -> dict[str, list[int]]:
    """From which robots a topic, by its name at the source, was heard."""
    found: dict[str, list[int]] = {}
    for topic in topics:
        if (heard := HEARD.fullmatch(topic.name)) is not None:
            found.setdefault(heard[2], []).append(int(heard[1]))
    return found


def _absolute(name: str) -> str:
    return f"/{name.removeprefix('/')}"
