"""Transports of PDUs to a flowgraph and back: PMTs over ZeroMQ, or octets over UDP or TCP."""

import asyncio
import contextlib
import errno
import socket
from collections.abc import Callable
from typing import Protocol, cast

import zmq

from backends import BackendError, open_endpoint
from sdrlinkd.errors import UserError
from sdrlinkd.pdulink.gnuradio.pdus import from_gnu_radio, to_gnu_radio
from sdrlinkd.reading import SocketReader
from sdrlinkd.wire import crc16

Take = Callable[[bytes], None]
AHEAD = 16
"""Most PDUs that wait in ZeroMQ for a flowgraph."""
RETRY_S = 0.5
RECEIVE_BYTES = 1 << 16


class Transport(Protocol):
    """Carries PDUs to a flowgraph and back; `take` gets each PDU received, on the event loop."""

    counters: dict[str, int]

    async def open(self, take: Take) -> None:
        """Open the sockets. Raises UserError."""

    def is_ready(self) -> bool:
        """Whether a PDU can be handed over now."""

    def send(self, pdu: bytes) -> bool:
        """Send a PDU; False if no flowgraph accepted it."""

    def close(self) -> None:
        """Close the sockets; may be called repeatedly."""


class ZmqTransport:
    """Carries PDUs by gr-zeromq's message blocks.

    We bind `send` and connect to `receive`, as gr-zeromq's own sinks and sources do. An @ before an
    endpoint binds it, a > connects.
    """

    def __init__(self, send: str, receive: str, publishes: bool) -> None:
        self._send, self._receive = send, receive
        self._kinds = (zmq.XPUB, zmq.SUB) if publishes else (zmq.PUSH, zmq.PULL)
        self._publishes = publishes
        self._context = zmq.Context()
        self._subscribed = 0
        self._out: zmq.Socket[bytes] | None = None
        self._reader: SocketReader[bytes] | None = None
        self.counters = {"bad_messages": 0}

    async def open(self, take: Take) -> None:
        """Open both sockets. Raises UserError."""
        kind_out, kind_in = self._kinds
        try:
            out = open_endpoint(
                self._context, kind_out, self._send, "gnuradio.send", binds=True, ahead=AHEAD
            )
            into = open_endpoint(
                self._context, kind_in, self._receive, "gnuradio.receive", binds=False, ahead=AHEAD
            )
        except BackendError as error:
            self.close()
            raise UserError(str(error)) from None
        if self._publishes:
            into.setsockopt(zmq.SUBSCRIBE, b"")

        def taken(data: bytes) -> None:
            try:
                pdu = from_gnu_radio(data)
            except ValueError:
                self.counters["bad_messages"] += 1
                return
            take(pdu)

        self._out = out
        self._reader = SocketReader(asyncio.get_running_loop(), into, into.recv, taken)

    def is_ready(self) -> bool:
        """Whether a flowgraph accepts a PDU now, or has subscribed."""
        out = self._out
        if out is None:
            return False
        if not self._publishes:
            return bool(int(out.getsockopt(zmq.EVENTS)) & zmq.POLLOUT)
        with contextlib.suppress(zmq.Again):
            while True:
                self._subscribed += 1 if out.recv(zmq.NOBLOCK)[:1] == b"\1" else -1
        return self._subscribed > 0

    def send(self, pdu: bytes) -> bool:
        """Send a PDU; False if no flowgraph accepted it."""
        if self._out is None:
            return False
        try:
            self._out.send(to_gnu_radio(pdu), zmq.NOBLOCK)
        except zmq.Again:
            return False
        return True

    def close(self) -> None:
        """Close both sockets and their context."""
        if self._reader is not None:
            self._reader.close()
        self._context.destroy(linger=0)
        self._reader = self._out = None


class UdpTransport(asyncio.DatagramProtocol):
    """Carries PDUs by a UDP socket_pdu, one per datagram.

    We send to `send`. PDUs come back to our port, or to `receive` if that is given; only the host
    of `send` may send them.
    """

    def __init__(self, send: str, receive: str) -> None:
        self._peer = _address(send, "send")
        self._own = _address(receive, "receive") if receive else None
        self._socket: asyncio.DatagramTransport | None = None
        self._take: Take = lambda _: None
        self._hosts: set[str] = set()
        """Addresses of the flowgraph's host."""
        self.counters = {"bad_messages": 0, "refused": 0, "strangers": 0}

    async def open(self, take: Take) -> None:
        """Open the UDP socket. Raises UserError."""
        self._take = take
        loop = asyncio.get_running_loop()
        try:
            if self._own is not None:
                found = await loop.getaddrinfo(*self._peer, type=socket.SOCK_DGRAM)
                self._hosts = {str(address[0]) for *_, address in found}
            where = await loop.getaddrinfo(*(self._own or self._peer), type=socket.SOCK_DGRAM)
            opened = self._open(*where[0])
            self._socket, _ = await loop.create_datagram_endpoint(lambda: self, sock=opened)
        except OSError as error:
            key, (host, port) = ("receive", self._own) if self._own else ("send", self._peer)
            why = error.strerror
            if error.errno == errno.EADDRINUSE:
                why = "another program uses this port; is a second daemon running?"
            raise UserError(f"gnuradio.{key}: {host}:{port}: cannot be opened ({why})") from None

    def _open(
        self, family: int, kind: int, number: int, _: str, address: tuple[str, int]
    ) -> socket.socket:
        """A socket at `address`, which is ours or the peer's. Raises OSError."""
        opened = socket.socket(family, kind, number)
        try:
            opened.setblocking(False)
            if self._own is not None:
                opened.bind(address)
            else:
                # So that the kernel lets only the peer's datagrams in.
                opened.connect(address)
        except OSError:
            opened.close()
            raise
        return opened

    def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
        """Take a datagram of the flowgraph's host, which holds one PDU."""
        if self._own is not None and addr[0] not in self._hosts:
            self.counters["strangers"] += 1
            return
        self._take(data)

    def error_received(self, exc: Exception) -> None:  # noqa: ARG002
        """Count an error, as no program listens at the address we send to."""
        self.counters["refused"] += 1

    def is_ready(self) -> bool:
        """Whether the socket is open; datagrams never wait."""
        return self._socket is not None

    def send(self, pdu: bytes) -> bool:
        """Send a PDU; False while there is no socket."""
        if self._socket is None:
            return False
        self._socket.sendto(pdu, self._peer if self._own else None)
        return True

    def close(self) -> None:
        """Close the UDP socket, if it is open."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


class TcpTransport(asyncio.Protocol):
    """Carries PDUs by a socket_pdu that is a TCP server, as octets without framing.

    All PDUs have the same size; the CRC shows where a PDU begins.
    """

    def __init__(self, send: str, pdu_size: int) -> None:
        self._peer = _address(send, "send")
        self._pdu_size = pdu_size
        self._socket: asyncio.Transport | None = None
        self._take: Take = lambda _: None
        self._have = bytearray()
        self._retry: asyncio.TimerHandle | None = None
        self._trying: asyncio.Task[None] | None = None
        self._is_closed = False
        self.counters = {"bad_octets": 0, "connections": 0}

    async def open(self, take: Take) -> None:
        """Connect to the flowgraph, now or once it appears."""
        self._take = take
        await self._connect()

    async def _connect(self) -> None:
        loop = asyncio.get_running_loop()
        try:
            await loop.create_connection(lambda: self, *self._peer)
        except OSError:
            self._later()

    def _later(self) -> None:
        if self._is_closed:
            return
        loop = asyncio.get_running_loop()

        def again() -> None:
            self._trying = asyncio.ensure_future(self._connect())

        self._retry = loop.call_later(RETRY_S, again)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Note that the flowgraph is connected."""
        self._socket = cast(asyncio.Transport, transport)
        self._have.clear()
        self.counters["connections"] += 1

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """Reconnect after a while, as the flowgraph is gone."""
        self._socket = None
        self._later()

    def data_received(self, data: bytes) -> None:
        """Take octets, and pass on the PDUs that they complete."""
        self._have += data
        size = self._pdu_size
        while len(self._have) >= size:
            pdu = bytes(self._have[:size])
            if crc16(pdu):
                self.counters["bad_octets"] += 1
                del self._have[0]
                continue
            del self._have[:size]
            self._take(pdu)

    def is_ready(self) -> bool:
        """Whether the flowgraph is connected and all octets sent have left."""
        return self._socket is not None and not self._socket.get_write_buffer_size()

    def send(self, pdu: bytes) -> bool:
        """Send a PDU; False while not connected."""
        if self._socket is None:
            return False
        self._socket.write(pdu)
        return True

    def close(self) -> None:
        """Disconnect, and do not reconnect."""
        self._is_closed = True
        for each in (self._retry, self._trying):
            if each is not None:
                each.cancel()
        if self._socket is not None:
            self._socket.abort()
            self._socket = None


def _address(text: str, key: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or not 0 < int(port) < 1 << 16:
        raise UserError(f'gnuradio.{key}: got "{text}"; allowed: HOST:PORT, "127.0.0.1:52001"')
    return host.strip("[]"), int(port)
