"""`web`: the page for operators."""

import asyncio
import re
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from sdrlinkd.cli.app import RuntimeDirs, app
from sdrlinkd.cli.listening import host_and_port
from sdrlinkd.cli.listing import directories
from sdrlinkd.client import runtime_dir as usual_directory
from sdrlinkd.config import ENDPOINT, FLEET_NAME, FleetParams
from sdrlinkd.doors import token_from
from sdrlinkd.errors import UserError
from sdrlinkd.extras import needs

TOKEN = "SDRLINK_WEB_TOKEN"  # noqa: S105 (the name of a variable)


def _fleet_name(name: str | None) -> str | None:
    if name is not None and not re.match(FLEET_NAME, name):
        raise UserError(f'--fleet: got "{name}"; allowed: letters, digits, _ and -')
    return name


def _endpoints(given: list[str] | None) -> list[str] | None:
    for each in given or ():
        if not re.match(ENDPOINT, each):
            raise UserError(f'--connect: got "{each}"; allowed: an endpoint such as tcp/base:7447')
    return given


def _own_first() -> list[Path]:
    """The daemons of this host, the one that other commands would ask first."""
    own = usual_directory()
    return sorted(directories(), key=lambda each: each != own)


@app.command("web")
def web(
    runtime_dir: RuntimeDirs = None,
    fleet: Annotated[
        str | None,
        typer.Option(help="Show the gateways of this fleet, over Zenoh.", callback=_fleet_name),
    ] = None,
    connect: Annotated[
        list[str] | None,
        typer.Option(help="Zenoh endpoint of a router of the fleet; may be repeated; "
                     "default: tcp/localhost:7447.", callback=_endpoints),
    ] = None,
    zenoh: Annotated[
        Path | None, typer.Option(help="File with more of Zenoh's configuration (JSON5).")
    ] = None,
    listen: Annotated[
        str, typer.Option(metavar="HOST:PORT", help="Where browsers open the page.")
    ] = "127.0.0.1:8420",
    control: Annotated[
        bool,
        typer.Option("--control", help="Let the page change policies of topics; asks for a token."),
    ] = False,
    token: Annotated[
        bool, typer.Option("--token", help=f"Ask for a token: that in {TOKEN}, else a new one.")
    ] = False,
    tls_cert: Annotated[
        Path | None, typer.Option(help="Serve HTTPS with this certificate (PEM).")
    ] = None,
    tls_key: Annotated[Path | None, typer.Option(help="Key of the certificate (PEM).")] = None,
    floor_plan: Annotated[
        Path | None,
        typer.Option(help="Draw a plan under the map: a YAML file of ROS's map_server."),
    ] = None,
) -> None:  # fmt: skip
    """Serve a page with map, link and topics until Ctrl-C."""
    with needs("web"):
        from sdrlinkd.web import (
            Options,
            World,
            follow_daemons,
            follow_fleet,
            read_floor_plan,
            serve,
        )
    host, port = host_and_port(listen, "--listen", "127.0.0.1:8420")
    options = Options(
        host, port, token_from(TOKEN) if token or control else "", control,
        tls_cert, tls_key, None if floor_plan is None else read_floor_plan(floor_plan),
    )  # fmt: skip
    world = World()
    if fleet is None:
        find = (lambda: runtime_dir) if runtime_dir else _own_first
        feed = partial(follow_daemons, world, find)
    else:
        params = FleetParams(name=fleet, connect=connect or [], zenoh=str(zenoh or ""))
        feed = partial(follow_fleet, world, params, Path())
    if not options.is_local and not options.token:
        typer.echo("warning: whoever reaches this port can read the page; --token asks for a token",
                   err=True)  # fmt: skip
    asyncio.run(serve(options, world, [feed], lambda url: typer.echo(f"page at {url}")))
