"""What tests look at, piece by piece; not part of the interface."""

from types import ModuleType

from sdrlinkd.foxglove import channels
from sdrlinkd.foxglove.channels import ReceivedTopics
from sdrlinkd.foxglove.door import CHANNEL, Door
from sdrlinkd.foxglove.operators import Operators, cdr_of
from sdrlinkd.foxglove.scene import Scene
from sdrlinkd.foxglove.server import SlowClients, start_server

__all__ = [
    "CHANNEL",
    "CONSTANTS",
    "Door",
    "Operators",
    "ReceivedTopics",
    "Scene",
    "SlowClients",
    "cdr_of",
    "start_server",
]

CONSTANTS: dict[str, tuple[ModuleType, str]] = {
    "channel": (channels, "Channel"),
    "most_channels": (channels, "MOST_CHANNELS"),
    "most_kept_bytes": (channels, "MOST_KEPT_BYTES"),
}
"""Constants that tests replace: `monkeypatch.setattr(*CONSTANTS["most_channels"], 5)`."""
