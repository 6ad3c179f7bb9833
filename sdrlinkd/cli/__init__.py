"""The command line of sdrlinkctl."""

from sdrlinkd.cli.app import main, run

__all__ = ["main", "run"]
