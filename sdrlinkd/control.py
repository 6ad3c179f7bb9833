"""The control socket: versioned verbs, answered from the node (bus document, section 5)."""

import asyncio
import logging
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
import zmq

from sdrlinkd.bus import RuntimeDirectory
from sdrlinkd.client import CONTROL_SOCKET
from sdrlinkd.errors import UserError
from sdrlinkd.reading import SocketReader

log = logging.getLogger("sdrlinkd")

PROTOCOL = b"sdrl1"
LARGEST_REQUEST = 1 << 20
"""Largest frame of a request in octets; a client that sends more is cut off."""

Arguments = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Verb:
    """The handler of a request; verbs with `changes` are for root and the service's own user."""

    answer: Callable[[Arguments], object]
    help: str
    changes: bool = False


class ControlError(UserError):
    """A request that cannot be served; `code` is for programs, the message for people."""

    def __init__(self, code: str, reason: str) -> None:
        super().__init__(reason)
        self.code = code


class Control:
    """Serves requests on a ROUTER socket, on the event loop, one at a time."""

    def __init__(
        self,
        context: zmq.Context[zmq.Socket[bytes]],
        directory: RuntimeDirectory,
    ) -> None:
        self._verbs: Mapping[str, Verb] = {}
        self._socket = directory.bind(
            context,
            zmq.ROUTER,
            CONTROL_SOCKET,
            {zmq.ROUTER_MANDATORY: 1, zmq.MAXMSGSIZE: LARGEST_REQUEST},
        )
        self._allowed_uids = {0, os.getuid()}
        self.requests = 0
        loop = asyncio.get_running_loop()
        self._reader = SocketReader(loop, self._socket, self._receive, self._take)

    def serve(self, verbs: Mapping[str, Verb]) -> None:
        """Answer `verbs` from now on."""
        self._verbs = verbs

    def close(self) -> None:
        """Stop serving; pending answers have 200 ms to leave."""
        self._reader.close()
        self._socket.close(linger=200)

    def _receive(self, flags: int) -> list[zmq.Frame]:
        return self._socket.recv_multipart(flags, copy=False)

    def _take(self, frames: list[zmq.Frame]) -> None:
        self.requests += 1
        identity, *request = (frame.bytes for frame in frames)
        if len(request) != 4:
            self._reply(identity, b"", error("bad_request", f"{len(request)} frames, not 4"))
            return
        protocol, request_id, verb, body = request
        if protocol != PROTOCOL:
            answer = error("bad_version", f"got {protocol!r}, this daemon speaks {PROTOCOL!r}")
        else:
            answer = self._answer(verb.decode(errors="replace"), body, frames[-1])
        self._reply(identity, request_id, answer)

    def _answer(self, name: str, body: bytes, frame: zmq.Frame) -> tuple[bytes, object]:
        verb = self._verbs.get(name)
        if verb is None:
            return error("unknown_verb", f"{name}; allowed: {', '.join(self._verbs)}")
        if verb.changes and _uid(frame) not in self._allowed_uids:
            return error("denied", f"{name} changes the daemon; allowed: root and its own user")
        try:
            arguments = msgspec.msgpack.decode(body, type=Arguments) if body else {}
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as problem:
            return error("bad_request", f"{name}: arguments: {problem}")
        try:
            return b"ok", verb.answer(arguments)
        except ControlError as problem:
            return error(problem.code, str(problem))
        except UserError as problem:
            return error("refused", str(problem))
        except Exception as problem:
            log.exception("internal error in the verb %s", name)
            return error("internal", f"internal error, see the daemon's log: {problem}")

    def _reply(self, identity: bytes, request_id: bytes, answer: tuple[bytes, object]) -> None:
        status, body = answer
        try:
            self._socket.send_multipart(
                [identity, PROTOCOL, request_id, status, msgspec.msgpack.encode(body)],
                zmq.NOBLOCK,
            )
        except zmq.ZMQError:
            # The client has gone or does not read; waiting for it would stall all others.
            return
        finally:
            self._reader.recheck()


def error(code: str, reason: str) -> tuple[bytes, object]:
    """The (status, body) of the answer to a request that cannot be served."""
    return b"err", {"code": code, "reason": reason}


def _uid(frame: zmq.Frame) -> int:
    """The client's user id from ZeroMQ's Peer-Address, `host:uid:gid:pid`; -1 if not given."""
    parts = str(frame.get("Peer-Address")).split(":")
    return int(parts[1]) if len(parts) == 4 and parts[1].isdigit() else -1
