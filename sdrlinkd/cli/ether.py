"""`sdrlink-ether`: the hub of a simulated air."""

import signal
import tempfile
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from backends import Scheduling
from sdrlinkd import __version__
from sdrlinkd.cli.compiling import compile_first
from sdrlinkd.cli.pace import MAX_SEED, Pace, chosen_scenario, scenario_names
from sdrlinkd.cli.programs import run_program
from sdrlinkd.lab import find_scenario, make_hub

DEFAULT_DIRECTORY = Path(tempfile.gettempdir()) / "sdrlink-ether"

app = typer.Typer(name="sdrlink-ether", pretty_exceptions_enable=False, add_completion=True)


@app.command()
def ether(
    scenario: Annotated[
        Path | None,
        typer.Argument(
            help="Scenario: a file or the name of a shipped one; default: all robots in range.",
            autocompletion=scenario_names,
        ),
    ] = None,
    directory: Annotated[
        Path,
        typer.Option("--dir", help="Folder of the hub's sockets, as in the daemons' ether.dir."),
    ] = DEFAULT_DIRECTORY,
    listen: Annotated[
        str,
        typer.Option(
            metavar="HOST:PORT",
            help="Serve other computers, too: 0.0.0.0:47900. Whoever reaches the port may join.",
        ),
    ] = "",
    traces: Annotated[
        Path | None, typer.Option(help="Folder of the logs that a scenario replays.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, max=MAX_SEED, help="Random seed of the channel.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(min=1e-3, max=1e5, help="Seconds of a lock-step run.")
    ] = None,
    pace: Annotated[Pace | None, typer.Option(help="Real time or lock-step.")] = None,
) -> None:
    """Serve one simulated channel to daemons with `backend = "ether"` until Ctrl-C."""
    chosen = None
    if scenario is not None:
        scenario = find_scenario(scenario)
        chosen = chosen_scenario(scenario, seed, duration, pace)
    compile_first(Console(stderr=True))
    hub = make_hub(chosen, directory, traces, listen)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: hub.stop())
    title = "all robots in range, at 20 dB"
    if chosen is not None and scenario is not None:
        title = chosen.title or scenario.stem
    also = f", and at {listen}" if listen else ""
    Scheduling(is_urgent=False)
    served = f"sdrlink-ether {__version__}: {title}; sockets in {directory}{also}"
    hub.run(lambda: typer.echo(served))


def main() -> None:
    """Run the hub; the exit code is 2 for errors that a person can fix."""
    run_program(app, "sdrlink-ether")


if __name__ == "__main__":
    main()
