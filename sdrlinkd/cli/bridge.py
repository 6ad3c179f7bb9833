"""`bridge foxglove`: the link, what it carries, and where robots are, in Foxglove."""

import asyncio
import ipaddress
import logging
from typing import Annotated

import typer
import uvloop

from sdrlinkd.cli.app import RuntimeDir, app
from sdrlinkd.cli.completion import heard_names
from sdrlinkd.cli.listening import host_and_port
from sdrlinkd.extras import needs
from sdrlinkd.journal import log_to_stderr

LISTEN = "127.0.0.1:8765"

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
            "repeatable; default: none.",
        ),
    ] = None,
    listen: Annotated[
        str, typer.Option(metavar="HOST:PORT", help="Where Foxglove connects; port 0: any.")
    ] = LISTEN,
    runtime_dir: RuntimeDir = None,
) -> None:
    """Serve received topics, the link's state and robots' places to Foxglove until Ctrl-C."""
    with needs("foxglove"):
        from sdrlinkd.foxglove import run_bridge
    host, port = host_and_port(listen, "--listen", LISTEN)
    patterns = publish or []

    def started(bound: int) -> None:
        shown = f"[{host}]" if ":" in host else host
        typer.echo(f"Foxglove connects to ws://{shown}:{bound}")
        for sentence in meanings(host, patterns):
            typer.echo(sentence, err=True)

    log_to_stderr(logging.INFO)
    directory = None if runtime_dir is None else str(runtime_dir)
    work = run_bridge(directory, host, port, patterns, topics or [], started)
    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        runner.run(work)


def meanings(host: str, patterns: list[str]) -> list[str]:
    """What the address and the patterns mean for who may see and who may send."""
    allowed = ", ".join(patterns)
    if not _is_local(host):
        may = f"sees all that robots send{', and may command ' + allowed if patterns else ''}"
        return [f"anybody who reaches {host} {may}: there is no password and no encryption"]
    if patterns:
        return [f"any program of this host may command {allowed}, and so may a page in its browser"]
    return []


def _is_local(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
