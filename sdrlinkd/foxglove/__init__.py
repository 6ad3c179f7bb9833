"""Shows to Foxglove what the daemon hears, its state and where robots are; takes commands back.

This package speaks to the daemon over the bus and the control socket only. It needs foxglove-sdk.
"""

from sdrlinkd.foxglove.bridge import run_bridge
from sdrlinkd.foxglove.commands import Command, judge
from sdrlinkd.foxglove.door import FOXGLOVE, Rules
from sdrlinkd.foxglove.report import BridgeReport
from sdrlinkd.json_schema import json_schema

__all__ = [
    "FOXGLOVE",
    "BridgeReport",
    "Command",
    "Rules",
    "json_schema",
    "judge",
    "run_bridge",
]
