"""sdrlinkctl."""

from sdrlinkd.cli import bag, demo, messages, pdu, status
from sdrlinkd.cli.app import main, run

__all__ = ["bag", "demo", "main", "messages", "pdu", "run", "status"]
