"""Foxglove's WebSocket server."""

import logging

import foxglove
from foxglove import Context
from foxglove.websocket import Capability, ServerListener, WebSocketServer

from sdrlinkd.errors import UserError
from sdrlinkd.foxglove.commands import ENCODINGS

MOST_WAITING = 256
"""Most messages that wait for a client that reads too slowly; then the oldest is dropped."""
CLIENTS = logging.getLogger("foxglove.websocket.connected_client")
"""What the SDK says of clients."""
FULL = "full"


class SlowClients(logging.Handler):
    """Counts how often the SDK says that a client was too slow; it says so in its log alone."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.count = 0
        foxglove.set_log_level(logging.INFO)
        CLIENTS.setLevel(logging.INFO)
        CLIENTS.addHandler(self)
        # For each message that waits for a client that leaves, it reports an error.
        CLIENTS.getChild("poller").setLevel(logging.CRITICAL)

    def emit(self, record: logging.LogRecord) -> None:
        """Take a line of the log."""
        self.count += record.name.endswith("send_lossy") and FULL in record.getMessage()

    def close(self) -> None:
        """Count no more."""
        CLIENTS.removeHandler(self)
        super().close()


def start_server(context: Context, listener: ServerListener) -> WebSocketServer:
    """Listen for the door on this host, at any port. Raises UserError."""
    try:
        return foxglove.start_server(
            name="sdrlink",
            host="127.0.0.1",
            port=0,
            capabilities=[Capability.ClientPublish],
            server_listener=listener,
            supported_encodings=list(ENCODINGS),
            context=context,
            message_backlog_size=MOST_WAITING,
        )
    except RuntimeError as error:
        reason = str(error).rpartition("Failed to bind port: ")[2]
        raise UserError(f"Foxglove's server: {reason}") from None
