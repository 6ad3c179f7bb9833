"""`routes`: shows who hears whom in the team, and who forwards what."""

import time
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from rich.console import Group, RenderableType
from rich.live import Live
from rich.text import Text

from sdrlinkd.cli.app import AsJson, RuntimeDir, app, connect
from sdrlinkd.cli.following import WATCH_PERIOD_S, Follower
from sdrlinkd.cli.output import load_pictures
from sdrlinkd.cli.screens import routes_screen
from sdrlinkd.cli.status import ask_status
from sdrlinkd.errors import UserError
from sdrlinkd.reports import Snapshot
from sdrlinkd.tables import screen_console


@app.command()
def routes(
    runtime_dir: RuntimeDir = None,
    as_json: AsJson = False,
    watch: Annotated[
        bool,
        typer.Option(
            "--watch", "-w", help="Refresh the screen until Ctrl-C, even across a restart."
        ),
    ] = False,
    picture: Annotated[
        Path | None,
        typer.Option(help="Also draw the links as a graph into this file (.png)."),
    ] = None,
) -> None:
    """Show who hears whom in the team, and who forwards what goes through this robot."""
    if watch and not as_json:
        _watch(Follower(runtime_dir))
    with connect(runtime_dir) as control:
        snapshot = ask_status(control)
    if picture is not None:
        _draw(snapshot, picture)
    if as_json:
        typer.echo(msgspec.json.encode(snapshot.link.routes).decode())
        return
    screen_console().print(_screen(snapshot))
    if picture is not None:
        typer.echo(f"wrote {picture}")


def _draw(snapshot: Snapshot, picture: Path) -> None:
    if picture.suffix != ".png":
        raise UserError(
            f"--picture: got {picture}; allowed: a name that ends in .png, .svg or .pdf"
        )
    if not snapshot.link.routes.robots:
        raise UserError('--picture: no links are known; they are with relay.policy = "auto"')
    try:
        load_pictures("sdrlinkd.cli").draw_routes(snapshot.node, snapshot.link.routes, picture)
    except OSError as error:
        raise UserError(f"--picture: {picture}: {error.strerror}") from None


def _watch(follower: Follower) -> None:
    """Keep the screen fresh until Ctrl-C."""
    console = screen_console()
    with follower, Live(console=console, screen=console.is_terminal, auto_refresh=False) as live:
        while True:
            snapshot = follower.look()
            shown: RenderableType = Text(follower.waiting, style="bold yellow")
            if snapshot is not None:
                shown = _screen(snapshot)
            live.update(shown, refresh=True)
            time.sleep(WATCH_PERIOD_S)


def _screen(snapshot: Snapshot) -> Group:
    return Group(*routes_screen(snapshot.node, snapshot.link.routes))
