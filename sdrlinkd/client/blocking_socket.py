"""The base of the blocking clients."""

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import zmq

from sdrlinkd.client.deadline import milliseconds
from sdrlinkd.client.errors import no_daemon, prepared
from sdrlinkd.client.paths import endpoint, is_prepared

LINGER_MS = 200

if TYPE_CHECKING:
    # ROS 2 Humble has Python 3.10, whose typing lacks Self; only type checkers need this import.
    from typing_extensions import Self


class Endpoint:
    """A ZeroMQ socket in its own context, closed by `with`."""

    def __init__(self, kind: int, runtime_dir: Path) -> None:
        self.runtime_dir = runtime_dir
        self._context = zmq.Context()
        self._socket = self._context.socket(kind)
        self._socket.linger = LINGER_MS

    @property
    def directory(self) -> Path:
        """Alias of `runtime_dir`, as in the constructor."""
        return self.runtime_dir

    def _connect(self, name: str, socket: "zmq.Socket[bytes] | None" = None) -> None:
        if is_prepared(self.runtime_dir):
            self.close()
            raise prepared(self.runtime_dir)
        try:
            (self._socket if socket is None else socket).connect(endpoint(self.runtime_dir, name))
        except zmq.ZMQError:
            self.close()
            raise no_daemon(self.runtime_dir) from None

    def _poll(self, timeout_s: float | None) -> bool:
        return bool(self._socket.poll(milliseconds(timeout_s)))

    def close(self) -> None:
        """Close the socket; messages sent have 200 ms to leave."""
        self._socket.close()
        self._context.term()

    def __enter__(self) -> "Self":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
