"""Runs sdrlinkctl as `python -m sdrlinkd.cli`."""

from sdrlinkd.cli import main

main()
