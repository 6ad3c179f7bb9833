"""Joins the robots that daemons hear to a fleet over Zenoh: the gateway, and what its peers need.

This package speaks to the daemon over the bus and the control socket only. It never sends by radio.
"""

from sdrlinkd.fleet.commands import Commands, Order, Refusal
from sdrlinkd.fleet.election import Election, score
from sdrlinkd.fleet.formats import (
    TERMS,
    Claim,
    Command,
    Fate,
    Passed,
    encode,
    is_passed,
    read_claim,
    read_command,
    read_fate,
    read_passed,
)
from sdrlinkd.fleet.forwarding import Forwarding, Turn
from sdrlinkd.fleet.gateway import run_gateway
from sdrlinkd.fleet.keys import Keys, TopicKey
from sdrlinkd.fleet.names import Duplicates
from sdrlinkd.fleet.report import GatewayReport
from sdrlinkd.fleet.samples import Answer
from sdrlinkd.fleet.session import open_session
from sdrlinkd.fleet.subscriber import FleetClient, FleetMessage
from sdrlinkd.fleet.zenoh_config import make_zenoh_config

__all__ = [
    "TERMS",
    "Answer",
    "Claim",
    "Command",
    "Commands",
    "Duplicates",
    "Election",
    "Fate",
    "FleetClient",
    "FleetMessage",
    "Forwarding",
    "GatewayReport",
    "Keys",
    "Order",
    "Passed",
    "Refusal",
    "TopicKey",
    "Turn",
    "encode",
    "is_passed",
    "make_zenoh_config",
    "open_session",
    "read_claim",
    "read_command",
    "read_fate",
    "read_passed",
    "run_gateway",
    "score",
]
