"""`bridge foxglove`: the link, what it carries, and where robots are, in Foxglove."""

import asyncio
import logging
from typing import Annotated
from urllib.parse import urlencode

import typer
import uvloop

from sdrlinkd.cli.app import RuntimeDir, app
from sdrlinkd.cli.completion import heard_names
from sdrlinkd.cli.listening import host_and_port
from sdrlinkd.doors import is_local, token_from
from sdrlinkd.extras import needs
from sdrlinkd.journal import log_to_stderr

LISTEN = "127.0.0.1:8765"
TOKEN = "SDRLINK_FOXGLOVE_TOKEN"  # noqa: S105 (the name of a variable)

bridges = typer.Typer(
    help="Show the link and what it carries in other programs.", no_args_is_help=True
)
app.add_typer(bridges, name="bridge")


@bridges.callback()
def _bridges() -> None:
    """A callback keeps the one command a command of its own."""


@bridges.command("foxglove")
def foxglove(
    topics: Annotated[
        list[str] | None,
        typer.Argument(
            help="Bus topics to show, such as /rx_robot_2/odom, or prefixes with *; default: all.",
            autocompletion=heard_names,
        ),
    ] = None,
    publish: Annotated[
        list[str] | None,
        typer.Option(
            metavar="PATTERN",
            help="Topics that people at Foxglove may send to robots, such as '/robot_*/cmd_vel'; "
            "repeatable; asks for a token; default: none.",
        ),
    ] = None,
    token: Annotated[
        bool, typer.Option("--token", help=f"Ask for a token: that in {TOKEN}, else a new one.")
    ] = False,
    allow_origin: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ORIGIN",
            help="Origin of a page that may connect without a token, besides app.foxglove.dev and "
            "those of this computer; repeatable.",
        ),
    ] = None,
    listen: Annotated[
        str, typer.Option(metavar="HOST:PORT", help="Where Foxglove connects; port 0: any.")
    ] = LISTEN,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Serve received topics, the link's state and robots' places to Foxglove until Ctrl-C."""
    with needs("foxglove"):
        from sdrlinkd.foxglove import FOXGLOVE, Rules, run_bridge
    host, port = host_and_port(listen, "--listen", LISTEN)
    patterns = publish or []
    asked = token_from(TOKEN) if token or patterns else ""
    rules = Rules(is_local(host), asked, (*FOXGLOVE, *(allow_origin or [])))

    def started(bound: int) -> None:
        shown = f"[{host}]" if ":" in host else host
        query = f"/?{urlencode({'token': rules.token})}" if rules.token else ""
        typer.echo(f"Foxglove connects to ws://{shown}:{bound}{query}")
        for sentence in meanings(host, patterns, has_token=bool(rules.token)):
            typer.echo(sentence, err=True)

    log_to_stderr(logging.INFO)
    directory = None if runtime_dir is None else str(runtime_dir)
    work = run_bridge(directory, host, port, patterns, topics or [], rules, started)
    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        runner.run(work)


def meanings(host: str, patterns: list[str], *, has_token: bool) -> list[str]:
    """What the address, the patterns and the token mean for who may see and who may send."""
    told = []
    if patterns:
        told.append(f"who has this address may command {', '.join(patterns)}: keep it to yourself")
    if not is_local(host):
        who = "who has this address" if has_token else "anybody who reaches it (see --token)"
        told.append(f"{who} sees all that robots send at {host}: there is no encryption")
    return told
