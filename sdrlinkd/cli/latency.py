"""`latency`: how late messages come, why, and how well other robots' clocks are known."""

import sys
import time
from typing import Annotated

import msgspec
import typer
from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from sdrlinkd.cli.app import AsJson, RuntimeDir, app, connect
from sdrlinkd.cli.policy import topic_names
from sdrlinkd.cli.render import NOTHING, boxless, clock_state, milliseconds
from sdrlinkd.cli.status import WATCH_PERIOD_S, ask_status
from sdrlinkd.errors import UserError
from sdrlinkd.reports import LatencyReport, LinkReport, ReceivedTopicReport

WIDE = 130
"""In a file, nothing is cut short at the 80 columns of a terminal that is not there."""
WIDTH = 30
"""Characters of the longest waterfall."""
PARTS = (
    ("queue", "queue_ms", "░", "yellow"),
    ("access", "access_ms", "▒", "magenta"),
    ("again", "again_ms", "!", "red"),
    ("source", "unsplit_ms", "░", "yellow"),
    ("frags", "reassembly_ms", "▓", "cyan"),
    ("air", "air_ms", "█", "blue"),
    ("rx", "handover_ms", "·", "green"),
)
"""Name, field, character and colour of each part, in the order of time."""
MEANING = (
    "queue: for others before it; access: for the air; again: after a burst that did not leave; "
    "frags: from its first fragment to its last; air: the last one; rx: demodulated and given to "
    "the bus"
)


@app.command()
def latency(
    topic: Annotated[
        str | None,
        typer.Argument(help="Only this one, in full.", autocompletion=topic_names),
    ] = None,
    runtime_dir: RuntimeDir = None,
    as_json: AsJson = False,
    watch: Annotated[bool, typer.Option("--watch", "-w", help="Keep the screen fresh.")] = False,
) -> None:
    """How late messages come and why, topic by topic; and the clocks of the robots heard."""
    with connect(runtime_dir) as control:

        def look() -> tuple[LinkReport, list[ReceivedTopicReport]]:
            link = ask_status(control).link
            return link, _chosen(link, topic)

        link, heard = look()
        if as_json:
            told = {
                "topics": heard,
                "clocks": {each.src: each.clock for each in link.neighbors if each.clock},
            }
            typer.echo(msgspec.json.encode(told).decode())
            return
        console = Console() if sys.stdout.isatty() else Console(width=WIDE)
        if not watch:
            console.print(screen(link, heard, whole=topic is not None))
            return
        with Live(console=console, auto_refresh=False) as live:
            while True:
                live.update(screen(*look(), whole=topic is not None), refresh=True)
                time.sleep(WATCH_PERIOD_S)


def _chosen(link: LinkReport, name: str | None) -> list[ReceivedTopicReport]:
    if name is None:
        return link.received
    wanted = name.lstrip("/")
    found = [
        each
        for each in link.received
        if wanted in (each.name.lstrip("/"), each.republished_as.lstrip("/"))
    ]
    if not found:
        known = ", ".join(each.republished_as or each.name for each in link.received)
        raise UserError(f"topic {name}: not heard; allowed: {known or 'none yet'}")
    return found


def screen(link: LinkReport, heard: list[ReceivedTopicReport], *, whole: bool) -> RenderableType:
    """The waterfalls, and the clocks below them."""
    timed = [each for each in heard if each.latency is not None]
    clocks = _clocks(link)
    if not timed:
        nothing = Text("no message with a STAMP was heard yet")
        return nothing if clocks is None else Group(nothing, clocks)
    longest_ms = max(_total_ms(each.latency) for each in timed if each.latency)
    parts: list[RenderableType] = [_waterfalls(timed, longest_ms)]
    if whole:
        parts += [_percentiles(each) for each in timed]
    parts.append(Text(MEANING, style="dim"))
    if clocks is not None:
        parts.append(clocks)
    return Group(*parts)


def _waterfalls(heard: list[ReceivedTopicReport], longest_ms: float) -> Table:
    table = boxless("latency, recent means in ms")
    names = [each.republished_as or each.name for each in heard]
    table.add_column("topic", no_wrap=True, min_width=max(map(len, names)))
    table.add_column("age", justify="right", no_wrap=True)
    for name, field, *_ in PARTS:
        if any(_part_ms(each.latency, field) is not None for each in heard):
            table.add_column(name, justify="right", no_wrap=True)
    for name in ("p99", "jitter"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    for each, topic in zip(heard, names, strict=True):
        latency = each.latency
        row = [topic, milliseconds(_total_ms(latency))]
        for _, field, *_ in PARTS:
            if any(_part_ms(other.latency, field) is not None for other in heard):
                row.append(milliseconds(_part_ms(latency, field)))
        row += [milliseconds(each.age_ms_p99), milliseconds(latency.jitter_ms if latency else None)]
        table.add_row(*row, _bar(latency, longest_ms))
    return table


def _bar(latency: LatencyReport | None, longest_ms: float) -> Text:
    bar, at_ms, drawn = Text(), 0.0, 0
    for _, field, character, colour in PARTS:
        at_ms += _part_ms(latency, field) or 0.0
        end = round(WIDTH * at_ms / longest_ms) if longest_ms else 0
        bar.append(character * (end - drawn), style=colour)
        drawn = max(drawn, end)
    return bar


def _part_ms(latency: LatencyReport | None, field: str) -> float | None:
    if latency is None:
        return None
    if field == "unsplit_ms":
        # The source has not told what its part is made of.
        return latency.wait_ms if latency.queue_ms is None else None
    value: float | None = getattr(latency, field)
    return value


def _total_ms(latency: LatencyReport | None) -> float:
    if latency is None:
        return 0.0
    return latency.wait_ms + latency.reassembly_ms + latency.air_ms + latency.handover_ms


def _percentiles(topic: ReceivedTopicReport) -> Text:
    """All ages since the start."""
    latency = topic.latency
    if latency is None:
        return Text()
    told = ", ".join(
        f"{name if name == 'max' else 'p' + name} {milliseconds(value)}"
        for name, value in latency.percentiles_ms.items()
    )
    lines = [f"{topic.republished_as or topic.name}: all ages in ms: {told}"]
    if latency.period_ms is not None:
        lines.append(
            f"one every {milliseconds(latency.period_ms)} ms, "
            f"give or take {milliseconds(latency.jitter_ms)} (Jd)"
        )
    if topic.stops:
        lines.append(f"stop messages published because nothing came: {topic.stops}")
    return Text("\n".join(lines))


def _clocks(link: LinkReport) -> Table | None:
    known = [(each.src, each.clock) for each in link.neighbors if each.clock is not None]
    if not known:
        return None
    table = boxless("clocks")
    for column in (
        "robot",
        "state",
        "its host is behind by",
        "our radio gains",
        "jumps",
        "odd stamps",
    ):
        table.add_column(column, justify="left" if column in ("robot", "state") else "right")
    for src, clock in known:
        host = NOTHING
        if clock.wall_offset_ms is not None and clock.wall_bound_us is not None:
            host = f"{clock.wall_offset_ms:.3f} ms ± {clock.wall_bound_us / 1e3:.3f}"
        table.add_row(
            str(src),
            clock_state(clock),
            host,
            NOTHING if clock.skew_ppm is None else f"{clock.skew_ppm:+.2f} ppm",
            str(clock.steps + clock.resets),
            str(clock.contradicted + clock.refused),
        )
    return table
