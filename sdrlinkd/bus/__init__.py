"""The local ZeroMQ bus of one daemon; the document beside this file is its contract."""

from sdrlinkd.bus.bus import PDU_TAP, Bus
from sdrlinkd.bus.intake import Ingress
from sdrlinkd.bus.sockets import MAX_DIRECTORY_BYTES, RuntimeDirectory, is_foreign

__all__ = [
    "MAX_DIRECTORY_BYTES",
    "PDU_TAP",
    "Bus",
    "Ingress",
    "RuntimeDirectory",
    "is_foreign",
]
