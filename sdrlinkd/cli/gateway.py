"""`sdrlink-gateway`: joins a daemon's robots to a fleet over Zenoh."""

import asyncio
import logging
import signal
from collections.abc import Coroutine
from pathlib import Path
from typing import Annotated, Any

import typer
import uvloop

from sdrlinkd import __version__
from sdrlinkd.cli.programs import run_program
from sdrlinkd.config import load_config, make_setup
from sdrlinkd.extras import needs
from sdrlinkd.journal import log_to_stderr

DEFAULT_CONFIG = Path("/etc/sdrlinkd/sdrlinkd.toml")

app = typer.Typer(name="sdrlink-gateway", pretty_exceptions_enable=False, add_completion=True)


@app.command()
def gateway(
    config: Annotated[
        Path, typer.Option("--config", metavar="FILE", help="The daemon's configuration (TOML).")
    ] = DEFAULT_CONFIG,
    check: Annotated[
        bool,
        typer.Option("--check", help="Check the table `fleet` and the file it names, and exit."),
    ] = False,
    version: Annotated[bool, typer.Option("--version", help="Print the version and exit.")] = False,
) -> None:
    """Put what the daemon's robots send on Zenoh, and send them what the table `fleet` allows."""
    if version:
        typer.echo(f"sdrlink-gateway {__version__}")
        return
    setup = make_setup(load_config(config), config.parent, str(config))
    with needs("zenoh"):
        from sdrlinkd.fleet import make_zenoh_config, run_gateway
    if check:
        make_zenoh_config(setup.config.fleet, config.parent)
        typer.echo("the configuration is valid")
        return
    log_to_stderr(logging.INFO)
    with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
        runner.run(_until_stopped(run_gateway(setup, config.parent)))


async def _until_stopped(work: Coroutine[Any, Any, None]) -> None:
    """Do `work` until SIGINT or SIGTERM."""
    task = asyncio.ensure_future(work)
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, task.cancel)
    try:
        await task
    except asyncio.CancelledError:
        return


def main() -> None:
    """Run the gateway; the exit code is 2 for errors that a person can fix."""
    run_program(app, "sdrlink-gateway")


if __name__ == "__main__":
    main()
