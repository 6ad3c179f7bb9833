"""Joins the robots that daemons hear to a fleet over Zenoh: the gateway, and what its peers need.

This package speaks to the daemon over the bus and the control socket only. It never sends by radio.
"""

from sdrlinkd.fleet.commands import Commands, Order, Refusal
from sdrlinkd.fleet.election import Election, score
from sdrlinkd.fleet.formats import (
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
from sdrlinkd.fleet.forwarding import Forwarding
from sdrlinkd.fleet.gateway import Gateway, run_gateway
from sdrlinkd.fleet.keys import Keys, TopicKey
from sdrlinkd.fleet.names import Duplicates
from sdrlinkd.fleet.report import GatewayReport
from sdrlinkd.fleet.session import Session, open_session
from sdrlinkd.fleet.subscriber import FleetClient, FleetMessage
from sdrlinkd.fleet.zenoh_config import check_zenoh

__all__ = [
    "Claim",
    "Command",
    "Commands",
    "Duplicates",
    "Election",
    "Fate",
    "FleetClient",
    "FleetMessage",
    "Forwarding",
    "Gateway",
    "GatewayReport",
    "Keys",
    "Order",
    "Passed",
    "Refusal",
    "Session",
    "TopicKey",
    "check_zenoh",
    "encode",
    "is_passed",
    "open_session",
    "read_claim",
    "read_command",
    "read_fate",
    "read_passed",
    "run_gateway",
    "score",
]
