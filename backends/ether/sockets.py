"""The hub's sockets, in a folder that belongs to the hub alone."""

import fcntl
from collections.abc import Callable
from pathlib import Path
from typing import IO

import msgspec
import numpy as np
import zmq

from backends.base import BackendError, Samples
from backends.ether import protocol
from backends.hub_address import AIR, SKY, HubAddress, hub_in

# Plain numbers: enumerations would cost as much as a short message.
NOBLOCK, MORE, _EVENTS, _POLLIN = (
    int(zmq.NOBLOCK), int(zmq.SNDMORE), int(zmq.EVENTS), int(zmq.POLLIN),
)  # fmt: skip
# Messages that may wait for a radio.
WAITING = 500
RECONNECT_MS = 500
LONGEST_MESSAGE = 1 << 26
"""Bytes of a message that a hub takes from another computer: eight million samples."""


def connect(
    context: "zmq.Context[zmq.Socket[bytes]]", kind: int, endpoint: str
) -> "zmq.Socket[bytes]":
    """Connect a radio's socket to its hub. Raises BackendError."""
    socket = context.socket(kind)
    socket.setsockopt(zmq.LINGER, 100)
    socket.setsockopt(zmq.RCVHWM, WAITING)
    socket.setsockopt(zmq.RECONNECT_IVL_MAX, RECONNECT_MS)
    try:
        socket.connect(endpoint)
    except zmq.ZMQError as error:
        shown = endpoint.removeprefix("ipc://")
        raise BackendError(f"{shown}: cannot be reached ({error.strerror})") from None
    return socket


class HubSockets:
    """The hub's two sockets: `air` (ROUTER) answers and hands out, `sky` (PULL) receives.

    With `listen` other computers can reach them too: everybody who reaches the port.
    Raises BackendError when the folder or the port is not available.
    """

    def __init__(self, directory: Path, listen: HubAddress | None = None) -> None:
        here = hub_in(directory)
        self._files = (directory / AIR, directory / SKY)
        self._lock = _locked(directory)
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self._air = self._bind(zmq.ROUTER, here.air)
        self._sky = self._bind(zmq.PULL, here.sky)
        if listen is not None:
            for socket, endpoint in ((self._air, listen.air), (self._sky, listen.sky)):
                # It counts for what is bound from now on: strangers get this far, no further.
                socket.setsockopt(zmq.MAXMSGSIZE, LONGEST_MESSAGE)
                self._listen(socket, endpoint)
        self._poller = zmq.Poller()
        for each in (self._air, self._sky):
            self._poller.register(each, zmq.POLLIN)

    def wait(self, wait_ms: int) -> bool:
        """Wait for messages for at most `wait_ms`; returns whether there is one."""
        return bool(self._poller.poll(wait_ms))

    def take(
        self,
        from_radio: Callable[[list[bytes]], None],
        request: Callable[[list[bytes]], None],
    ) -> None:
        """Hand over all messages that are waiting now."""
        _drain(self._sky, from_radio)
        _drain(self._air, request)

    def reply(self, identity: bytes, message: msgspec.Struct, samples: Samples | None) -> bool:
        """Send without waiting; False when there is no room for the message.

        Raises ConnectionError when no peer has that identity.
        """
        data, air = protocol.encode(message), self._air
        try:
            air.send(identity, NOBLOCK | MORE)
            if samples is None:
                air.send(data, NOBLOCK)
            else:
                air.send(data, NOBLOCK | MORE)
                air.send(np.ascontiguousarray(samples).data.cast("B"), NOBLOCK)
        except zmq.Again:
            return False
        except zmq.ZMQError as error:
            if error.errno == zmq.EHOSTUNREACH:
                raise ConnectionError from None
            raise
        return True

    def close(self) -> None:
        """Close the sockets and free the folder."""
        self._context.destroy(linger=100)
        for path in self._files:
            path.unlink(missing_ok=True)
        self._lock.close()

    def _bind(self, kind: int, endpoint: str) -> "zmq.Socket[bytes]":
        socket = self._context.socket(kind)
        if kind == zmq.ROUTER:
            socket.setsockopt(zmq.ROUTER_MANDATORY, 1)
        socket.setsockopt(zmq.SNDHWM, WAITING)
        socket.setsockopt(zmq.LINGER, 0)
        self._listen(socket, endpoint)
        return socket

    def _listen(self, socket: "zmq.Socket[bytes]", endpoint: str) -> None:
        try:
            socket.bind(endpoint)
        except zmq.ZMQError as error:
            self.close()
            shown = endpoint.removeprefix("ipc://")
            raise BackendError(f"{shown}: the hub's socket cannot be opened ({error})") from None


def is_readable(socket: "zmq.Socket[bytes]") -> bool:
    """Whether a message is waiting."""
    return bool(int(socket.getsockopt(_EVENTS)) & _POLLIN)


def received(socket: "zmq.Socket[bytes]") -> tuple[protocol.FromHub, Samples | None]:
    """The next message and its samples, at a radio. Raises zmq.Again."""
    frames = socket.recv_multipart(NOBLOCK)
    return protocol.from_hub(frames[0]), protocol.samples_in(frames)


def _drain(socket: "zmq.Socket[bytes]", take: Callable[[list[bytes]], None]) -> None:
    while is_readable(socket):
        frames = socket.recv_multipart(NOBLOCK)
        try:
            take(frames)
        except (msgspec.DecodeError, ValueError, RecursionError):
            # Not a message of this protocol; the sender gets no answer.
            continue


def _locked(directory: Path) -> IO[str]:
    """Lock the folder: a second bind would take a running hub's sockets away."""
    path = directory / "ether.lock"
    try:
        directory.mkdir(parents=True, exist_ok=True)
        lock = path.open("w")
    except OSError as error:
        raise BackendError(f"{path}: cannot be opened ({error.strerror})") from None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        lock.close()
        raise BackendError(
            f"{directory}: another hub serves this folder; stop it, or name another one"
        ) from None
    return lock
