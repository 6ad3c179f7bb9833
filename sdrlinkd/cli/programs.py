"""Runs the programs beside `sdrlinkctl`."""

import sys

import typer

from sdrlinkd.errors import UserError
from sdrlinkd.parent import end_with_parent


def run_program(app: typer.Typer, name: str) -> None:
    """Run a program; the exit code is 2 for errors that a person can fix."""
    end_with_parent()
    try:
        app(prog_name=name)
    except UserError as error:
        sys.stderr.write(f"{name}: {error}\n")
        sys.exit(2)
