"""sdrlinkctl."""

from sdrlinkd.cli import bag, demo, lab, messages, pdu, phy, policy, status, wifi
from sdrlinkd.cli.app import main, run

__all__ = [
    "bag",
    "demo",
    "lab",
    "main",
    "messages",
    "pdu",
    "phy",
    "policy",
    "run",
    "status",
    "wifi",
]
