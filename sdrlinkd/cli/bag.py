"""`bag info` and `bag play`: summarizes a recording, and plays one to a running daemon."""

import itertools
import math
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from sdrlinkd.adapters import (
    BagMessage,
    BagSummary,
    BagTopic,
    cdr_from_fields,
    first_seconds,
    from_second,
    open_bag,
    paced,
    summarise,
)
from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import RuntimeDir, app, connect
from sdrlinkd.client import MessageRefusedError, Publisher, RefusedError
from sdrlinkd.errors import BagError, UserError
from sdrlinkd.reports import TopicReport
from sdrlinkd.tables import FittedTable, figure, screen_console, words

COLUMNS = (
    TextColumn("{task.description}", markup=False),
    BarColumn(),
    MofNCompleteColumn(),
    TimeRemainingColumn(),
)

CLOCK, CLOCK_TYPE = "/clock", "rosgraph_msgs/msg/Clock"
SECOND_NS = 1_000_000_000
NOT_CARRIED = "not a topic that the daemon carries"

bags = typer.Typer(help="Recordings of messages.", no_args_is_help=True)
app.add_typer(bags, name="bag")


@bags.command()
def info(bag: Annotated[Path, typer.Argument(help="rosbag2 folder, .mcap, .db3 or .bag")]) -> None:
    """Show a recording's duration, and the count, rate and sizes of each topic's messages."""
    opened = open_bag(bag)
    console = Console(stderr=True)
    with Progress(
        *COLUMNS, console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task(bag.name, total=sum(topic.n_messages for topic in opened.topics()))
        found = summarise(opened, lambda done: bar.update(task, completed=done))
    opened.close()
    typer.echo(
        f"{found.duration_s:.1f} s, {found.n_messages} messages, {found.n_bytes / 1e6:.2f} MB"
    )
    screen_console().print(table_of(found))
    if opened.damage:
        raise BagError(opened.damage)


def table_of(found: BagSummary) -> FittedTable:
    """The table of a recording, with a row per topic."""
    table = FittedTable(
        "",
        (figure("count"), figure("Hz"), figure("mean B", 2), figure("max B", 3), words("topic"),
         words("type", 1)),
    )  # fmt: skip
    for topic in found.topics:
        table.add(
            str(topic.n_messages), "–" if topic.rate_hz is None else f"{topic.rate_hz:.2f}",
            f"{topic.mean_bytes:.0f}", str(topic.max_bytes), topic.name, topic.type,
        )  # fmt: skip
    return table


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
    runtime_dir: RuntimeDir = None,
) -> None:
    """Play a recording to the daemon: rosbag2 verbatim, ROS 1 converted.

    Topics that the daemon does not know are declared, if it takes them (auto = true).
    """
    console = Console(stderr=True)
    opened = open_bag(bag)
    with connect(runtime_dir) as control:
        snapshot = ask_status(control)
        if clock:
            control.ask(
                "declare", {"name": CLOCK, "type": CLOCK_TYPE, "reliability": "best_effort"}
            )
        taken = {topic.name: topic for topic in snapshot.link.topics if topic.subscribed}
        route, left_out, unknown = _route(
            opened.topics(), taken, snapshot.namespace, topics or [], remap or []
        )
        for topic, name in unknown.items():
            try:
                control.ask("declare", {"name": name, "type": topic.type})
            except RefusedError:
                left_out[topic.name] = NOT_CARRIED
            else:
                route[topic.name] = name
    for name, reason in left_out.items():
        console.print(f"left out: {name} ({reason})", style="yellow", markup=False)
    if not route:
        raise UserError(
            f"{bag}: the daemon carries none of its topics; it carries {', '.join(taken)}"
        )

    def messages() -> Iterator[BagMessage]:
        played = opened.messages()
        if start:
            played = from_second(played, start)
        if duration is not None:
            played = first_seconds(played, duration)
        return (message for message in played if message.topic in route)

    total = sum(topic.n_messages for topic in opened.topics() if topic.name in route)
    if start or duration is not None:
        # Only reading all of them shows how many there are.
        total = sum(1 for _ in messages())
    if loop and not total:
        opened.close()
        raise UserError(f"{bag}: no messages to play again and again; give another --start")
    sent, refused = 0, dict[str, list[str]]()
    with Publisher(runtime_dir) as publisher, Progress(*COLUMNS, console=console) as progress:
        for _ in itertools.count() if loop else range(1):
            task = progress.add_task(bag.name, total=total)
            told_ns = -math.inf
            for message in paced(messages(), rate):
                if clock and message.time_ns - told_ns >= SECOND_NS / clock:
                    told_ns = message.time_ns
                    publisher.send(CLOCK, clock_message(message.time_ns))
                try:
                    publisher.send(route[message.topic], message.cdr, type=message.type)
                    sent += 1
                except MessageRefusedError as error:
                    refused.setdefault(message.topic, []).append(str(error))
                progress.advance(task)
            if loop:
                progress.remove_task(task)
    opened.close()
    for name, reasons in refused.items():
        console.print(
            f"not sent: {len(reasons)} messages of {name} ({reasons[0]})",
            style="yellow",
            markup=False,
        )
    typer.echo(f"played {sent} messages of {bag}")
    if opened.damage:
        raise BagError(opened.damage)


def clock_message(time_ns: int) -> bytes:
    """A rosgraph_msgs/Clock as CDR."""
    seconds, ns = divmod(time_ns, SECOND_NS)
    return cdr_from_fields(CLOCK_TYPE, {"clock": {"sec": seconds, "nanosec": ns}}, CLOCK)


def _route(
    topics: list[BagTopic],
    taken: dict[str, TopicReport],
    namespace: str,
    only: list[str],
    remap: list[str],
) -> tuple[dict[str, str], dict[str, str], dict[BagTopic, str]]:
    """({topic of the bag: the daemon's topic}, {topic left out: reason}, {topic that the daemon
    does not know: what it would be called there}). Raises UserError.
    """
    mapping = {}
    for rule in remap:
        source, separator, target = rule.partition(":=")
        if not separator:
            raise UserError(f"--remap: got {rule!r}; allowed: /from:=/to")
        mapping[_absolute(source)] = target
    only = [_absolute(name) for name in only]
    known = {topic.name for topic in topics}
    for name in (*only, *mapping):
        if not any(fnmatchcase(each, name) for each in known):
            raise UserError(f"got {name}; allowed: the bag's topics {', '.join(sorted(known))}")
    route: dict[str, str] = {}
    left_out: dict[str, str] = {}
    unknown: dict[BagTopic, str] = {}
    for topic in topics:
        if only and not any(fnmatchcase(topic.name, each) for each in only):
            continue
        candidates = [mapping.get(topic.name, topic.name)]
        if namespace and topic.name not in mapping:
            candidates.append(f"/{namespace.strip('/')}{topic.name}")
        target = next((name for name in candidates if name in taken), "")
        if not target:
            unknown[topic] = candidates[-1]
        elif taken[target].type != topic.type:
            left_out[topic.name] = f"type {topic.type}, but the registry has {taken[target].type}"
        else:
            route[topic.name] = target
    return route, left_out, unknown


def _absolute(name: str) -> str:
    return f"/{name.removeprefix('/')}"
