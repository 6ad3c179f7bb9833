"""`routes`: shows who hears whom in the team, and who forwards what."""

from pathlib import Path
from typing import Annotated

import msgspec
import typer
from rich.console import Group

from sdrlinkd.asking import ask_status
from sdrlinkd.cli.app import AsJson, RuntimeDir, Watch, app, connect
from sdrlinkd.cli.following import watch_screen
from sdrlinkd.cli.output import load_pictures
from sdrlinkd.cli.screens import routes_screen
from sdrlinkd.errors import UserError
from sdrlinkd.reports import Snapshot
from sdrlinkd.tables import screen_console


@app.command()
def routes(
    runtime_dir: RuntimeDir = None,
    as_json: AsJson = False,
    watch: Watch = False,
    picture: Annotated[
        Path | None,
        typer.Option(help="Also draw the links as a graph into this file (.png)."),
    ] = None,
) -> None:
    """Show who hears whom in the team, and who forwards what goes through this robot."""
    if picture is not None and picture.suffix != ".png":
        raise UserError(f"--picture: got {picture}; allowed: names that end in .png")
    if watch and not as_json:
        watch_screen(runtime_dir, _screen)
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


def _screen(snapshot: Snapshot) -> Group:
    return Group(*routes_screen(snapshot.node, snapshot.link.routes))
