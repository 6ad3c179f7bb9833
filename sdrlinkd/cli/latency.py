"""`latency`: shows how late messages arrive and why, and how well other clocks are known."""

from typing import Annotated

import msgspec
import typer
from rich.console import Group

from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import AsJson, RuntimeDir, Watch, app, connect
from sdrlinkd.cli.completion import heard_names
from sdrlinkd.cli.following import watch_screen
from sdrlinkd.cli.screens import latency_screen
from sdrlinkd.errors import UserError
from sdrlinkd.reports import LinkReport, ReceivedTopicReport
from sdrlinkd.tables import screen_console


@app.command()
def latency(
    topic: Annotated[
        str | None,
        typer.Argument(help="Show only this topic, in full.", autocompletion=heard_names),
    ] = None,
    runtime_dir: RuntimeDir = None,
    as_json: AsJson = False,
    watch: Watch = False,
) -> None:
    """Show the latency of each received topic, its causes, and the clocks of the neighbors."""
    if watch and not as_json:
        watch_screen(runtime_dir, lambda snapshot: _screen(snapshot.link, topic))
    with connect(runtime_dir) as control:
        link = ask_status(control).link
    if as_json:
        told = {
            "topics": _chosen(link, topic),
            "clocks": {each.src: each.clock for each in link.neighbors if each.clock},
        }
        typer.echo(msgspec.json.encode(told).decode())
        return
    screen_console().print(_screen(link, topic))


def _screen(link: LinkReport, topic: str | None) -> Group:
    return Group(*latency_screen(link, _chosen(link, topic), whole=topic is not None))


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
