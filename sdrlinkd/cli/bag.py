"""`bag info`: summarizes a recording."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from sdrlinkd.adapters import (
    BagSummary,
    open_bag,
    summarise,
)
from sdrlinkd.cli.app import app
from sdrlinkd.errors import BagError
from sdrlinkd.health import span
from sdrlinkd.tables import FittedTable, figure, screen_console, words

COLUMNS = (
    TextColumn("{task.description}", markup=False),
    BarColumn(),
    MofNCompleteColumn(),
    TimeRemainingColumn(),
)

LONG_PAUSE_S = 60.0

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
    if found.pause_s > LONG_PAUSE_S:
        typer.echo(f"longest pause: {span(found.pause_s)}; bag play shortens it to --max-gap")
    for name, encoding in opened.skipped.items():
        typer.echo(f"not ROS messages: {name} ({encoding})")
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
