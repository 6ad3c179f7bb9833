"""sdrlinkctl."""

from sdrlinkd.cli import (
    bag,
    bench,
    demo,
    dictionary,
    lab,
    latency,
    messages,
    pdu,
    phy,
    plan,
    policy,
    radio,
    record,
    replay,
    status,
    wifi,
)
from sdrlinkd.cli.app import main, run

__all__ = [
    "bag", "bench", "demo", "dictionary", "lab", "latency", "main", "messages", "pdu", "phy",
    "plan", "policy", "radio", "record", "replay", "run", "status", "wifi",
]  # fmt: skip
