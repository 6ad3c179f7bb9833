"""`bench`: runs the project's benchmarks, if they are installed."""

import importlib.util
import subprocess
import sys
from typing import Annotated

import typer

from sdrlinkd.cli.app import app
from sdrlinkd.cli.benchmarks import BENCHMARKS
from sdrlinkd.errors import UserError


@app.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def bench(
    context: typer.Context,
    name: Annotated[
        str,
        typer.Argument(help="; ".join(BENCHMARKS), autocompletion=lambda: list(BENCHMARKS)),
    ],
) -> None:
    """Run a benchmark, such as `bench pound --quick`; further options are the benchmark's own."""
    if name not in BENCHMARKS:
        raise UserError(f"bench: got {name}; allowed: {', '.join(BENCHMARKS)}")
    if importlib.util.find_spec("benchmarks") is None:
        raise UserError("the benchmarks are only in the source tree; run this in a checkout of it")
    done = subprocess.run([sys.executable, "-m", f"benchmarks.{name}", *context.args], check=False)  # noqa: S603
    raise typer.Exit(done.returncode)
