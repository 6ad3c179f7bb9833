"""sdrlinkctl."""

from sdrlinkd.cli import bag, demo, messages, pdu, phy, status
from sdrlinkd.cli.app import main, run

__all__ = ["bag", "demo", "main", "messages", "pdu", "phy", "run", "status"]
