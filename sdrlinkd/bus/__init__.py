"""The local ZeroMQ bus of one daemon, specified by README.md in this folder (the bus document)."""

from sdrlinkd.bus.bus import AIR_TAP, PDU_TAP, SENT_TAP, Bus
from sdrlinkd.bus.envelope import fields_of, shown
from sdrlinkd.bus.intake import Ingress
from sdrlinkd.bus.sockets import (
    MAX_DIRECTORY_BYTES,
    RuntimeDirectory,
    check_directory,
    is_foreign,
    running_in,
)

__all__ = [
    "AIR_TAP",
    "MAX_DIRECTORY_BYTES",
    "PDU_TAP",
    "SENT_TAP",
    "Bus",
    "Ingress",
    "RuntimeDirectory",
    "check_directory",
    "fields_of",
    "is_foreign",
    "running_in",
    "shown",
]
