"""Queries the state of a hub."""

from pathlib import Path
from typing import Self

import zmq

from backends.base import BackendError
from backends.ether import protocol
from backends.hub_address import hub_in


class HubWatch:
    """Queries the hub whose sockets are in `directory`."""

    def __init__(self, directory: Path, timeout_s: float = 5.0) -> None:
        self._directory = directory
        self._timeout_ms = round(1e3 * timeout_s)
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._socket = self._context.socket(zmq.DEALER)
        try:
            self._socket.connect(hub_in(directory).air)
        except zmq.ZMQError as error:
            self._context.destroy(linger=0)
            raise BackendError(f"{directory}: cannot be reached ({error.strerror})") from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._context.destroy(linger=0)

    def ask(self) -> protocol.Answer:
        """The hub's state. Raises BackendError when it does not answer."""
        self._socket.send(protocol.encode(protocol.Question()))
        while self._socket.poll(self._timeout_ms):
            answer = protocol.from_hub(self._socket.recv_multipart()[0])
            if isinstance(answer, protocol.Answer):
                return answer
        raise BackendError(f"{self._directory}: the hub does not answer")
