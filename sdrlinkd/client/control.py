"""Requests to the daemon: status, checks, and the few settings that can be changed."""

import os
import secrets
import time
from typing import Any

import zmq

from sdrlinkd.client.blocking_socket import Endpoint
from sdrlinkd.client.errors import no_daemon
from sdrlinkd.client.flatmap import Value, pack_map, unpack
from sdrlinkd.client.paths import CONTROL_SOCKET, chosen_dir, is_there

PROTOCOL = b"sdrl1"


class RefusedError(Exception):
    """The daemon refused a request; `code` is for programs, the message for people."""

    def __init__(self, code: str, reason: str) -> None:
        super().__init__(reason)
        self.code = code


class ControlClient(Endpoint):
    """A client of the control socket, for one request at a time.

    Raises NoDaemonError if no daemon runs.
    """

    def __init__(
        self,
        runtime_dir: str | os.PathLike[str] | None = None,
        timeout_s: float = 5.0,
        *,
        directory: str | os.PathLike[str] | None = None,
    ) -> None:
        super().__init__(zmq.DEALER, chosen_dir(runtime_dir, directory))
        if not is_there(self.runtime_dir / CONTROL_SOCKET):
            self.close()
            raise no_daemon(self.runtime_dir)
        self._timeout_s = timeout_s
        self._socket.immediate = True
        self._connect(CONTROL_SOCKET)

    def ask(self, verb: str, arguments: dict[str, Value] | None = None) -> Any:  # noqa: ANN401
        """The daemon's answer to `verb`. Raises RefusedError and, without answer, NoDaemonError."""
        return unpack(self.ask_packed(verb, arguments))

    def ask_packed(self, verb: str, arguments: dict[str, Value] | None = None) -> bytes:
        """The daemon's answer to `verb` as MessagePack; raises as `ask` does."""
        request_id = secrets.token_bytes(4)
        deadline = time.monotonic() + self._timeout_s
        self._socket.sndtimeo = int(self._timeout_s * 1000)
        try:
            self._socket.send_multipart(
                [PROTOCOL, request_id, verb.encode(), pack_map(arguments or {})]
            )
        except zmq.Again:
            raise no_daemon(self.runtime_dir) from None
        while (left_s := deadline - time.monotonic()) > 0:
            if not self._poll(left_s):
                break
            _, answered_id, status, body = self._socket.recv_multipart()
            # Skip a late answer to an earlier request that timed out.
            if answered_id == request_id:
                if status != b"ok":
                    answer = unpack(body)
                    raise RefusedError(answer["code"], answer["reason"])
                return body
        raise no_daemon(self.runtime_dir)
