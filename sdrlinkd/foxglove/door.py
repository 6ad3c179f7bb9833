"""The door of the bridge: who may connect to Foxglove's server, and who may command.

The SDK's server sees neither origins nor tokens, so it listens for this door alone. Whoever gets
in is passed on octet by octet. For a client that may command, the door first advertises a topic
that nobody else can name: by that, `Operators` knows the client.
"""

import asyncio
import contextlib
import http.client
import io
import json
import secrets
import struct
from dataclasses import dataclass, field

from sdrlinkd.doors import (
    is_allowed,
    is_local_name,
    is_ours,
    is_token,
    split,
    token_in,
)
from sdrlinkd.errors import UserError

FOXGLOVE = ("https://app.foxglove.dev",)
"""The pages that may connect besides those of this computer."""
MOST_HEAD = 16384
"""Longest head of a request or an answer in octets."""
HEAD_S = 5.0
"""Time in s for the head of a request to come."""
MOST_CLIENTS, MOST_WAITING = 64, 256
"""Most clients at once, and most connections that have not said yet what they want: of those, the
oldest gives way."""
AT_ONCE = 1 << 16
CHANNEL = (1 << 32) - 1
"""Number of the channel that the door advertises; clients count from 1."""
_ENDS = (OSError, asyncio.IncompleteReadError, TimeoutError, asyncio.CancelledError)
_WITHOUT = "the bridge asks for its token: connect to the address that it printed"
_OTHERS = (
    "the program at the other end belongs to another account of this computer; start the bridge "
    "with --token, and connect to the address that it prints"
)


@dataclass(frozen=True)
class Rules:
    """Who gets in. `token` empty: none is asked for, and nobody commands."""

    is_local: bool
    token: str = ""
    origins: tuple[str, ...] = FOXGLOVE
    secret: str = field(default_factory=lambda: f"/{secrets.token_urlsafe(24)}")
    """The topic that tells that a client may command."""

    def refusal(
        self, target: str, headers: http.client.HTTPMessage, peer: tuple[str, int],
        own: tuple[str, int],
    ) -> str:  # fmt: skip
        """Why a request is refused, in a sentence; empty if it is not."""
        if self.token:
            return "" if is_token(token_in(split(target).query), self.token) else _WITHOUT
        if self.is_local and not all(map(is_local_name, headers.get_all("Host", [""]))):
            return "the bridge is asked for under another name; connect to the address it printed"
        for origin in headers.get_all("Origin", []):
            if not is_allowed(origin, self.origins):
                return (
                    f"a page of {origin[:80]!r} asks; allowed: {', '.join(self.origins)} and pages "
                    "of this computer; --allow-origin names others, --token asks for a token"
                )
        return _OTHERS if self.is_local and not is_ours(peer, own) else ""


class Door:
    """Listens at `host`:`port`, and passes on who gets in to the SDK's server at `inner`."""

    def __init__(self, rules: Rules, inner: int) -> None:
        self._rules = rules
        self._inner = inner
        self._server: asyncio.Server | None = None
        self._clients = 0
        self._waiting: dict[asyncio.StreamWriter, None] = {}
        self.refused = 0
        """Connections that were refused."""

    async def open(self, host: str, port: int) -> int:
        """Listen; returns the port. Raises UserError."""
        try:
            self._server = await asyncio.start_server(self._let_in, host, port, limit=MOST_HEAD)
        except OSError as error:
            raise UserError(f"--listen {host}:{port}: {error.strerror or error}") from None
        bound: int = self._server.sockets[0].getsockname()[1]
        return bound

    def close(self) -> None:
        """Listen no more."""
        if self._server is not None:
            self._server.close()

    async def _let_in(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            # A client may end as it likes; so may the loop, which would report those left.
            with contextlib.suppress(*_ENDS):
                await self._serve(reader, writer)
        finally:
            writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            head = await self._head(reader, writer)
            target, headers = _parsed(head)
        except (asyncio.LimitOverrunError, http.client.HTTPException, ValueError):
            await _refuse(writer, 400, "this is no request for a WebSocket")
            return
        peer, own = (writer.get_extra_info(name)[:2] for name in ("peername", "sockname"))
        sentence = self._rules.refusal(target, headers, peer, own)
        if not sentence and self._clients >= MOST_CLIENTS:
            sentence = f"got one client more; allowed: {MOST_CLIENTS} at once"
        if sentence:
            self.refused += 1
            await _refuse(writer, 403, sentence)
            return
        self._clients += 1
        try:
            await self._connect(head, reader, writer)
        finally:
            self._clients -= 1

    async def _head(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> bytes:
        """The head of a request. Raises LimitOverrunError, and what ends a connection."""
        self._waiting[writer] = None
        if len(self._waiting) > MOST_WAITING:
            next(iter(self._waiting)).close()
        try:
            async with asyncio.timeout(HEAD_S):
                return await reader.readuntil(b"\r\n\r\n")
        finally:
            self._waiting.pop(writer, None)

    async def _connect(
        self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        to, back = await asyncio.open_connection("127.0.0.1", self._inner, limit=MOST_HEAD)
        try:
            # The token is for nobody else.
            back.write(b"GET / HTTP/1.1\r\n" + head.split(b"\r\n", 1)[1])
            answer = await to.readuntil(b"\r\n\r\n")
            writer.write(answer)
            if self._rules.token and answer.startswith(b"HTTP/1.1 101 "):
                back.write(_advertising(self._rules.secret))
            await _pass_on(reader, back, to, writer)
        finally:
            back.close()


async def _pass_on(
    reader: asyncio.StreamReader, back: asyncio.StreamWriter,
    to: asyncio.StreamReader, writer: asyncio.StreamWriter,
) -> None:  # fmt: skip
    """Pass octets on both ways until one side ends."""

    async def pump(source: asyncio.StreamReader, sink: asyncio.StreamWriter) -> None:
        while octets := await source.read(AT_ONCE):
            sink.write(octets)
            # Who reads too slowly is the SDK's to judge.
            await sink.drain()

    pumps = [asyncio.ensure_future(pump(*ends)) for ends in ((reader, back), (to, writer))]
    _, running = await asyncio.wait(pumps, return_when=asyncio.FIRST_COMPLETED)
    for each in running:
        each.cancel()
    await asyncio.gather(*pumps, return_exceptions=True)


def _parsed(head: bytes) -> tuple[str, http.client.HTTPMessage]:
    """The target and the headers of a request. Raises ValueError, HTTPException."""
    line, rest = head.split(b"\r\n", 1)
    method, target, version = line.decode("ascii").split(" ")
    if method != "GET" or version != "HTTP/1.1":
        raise ValueError(method)
    return target, http.client.parse_headers(io.BytesIO(rest))


async def _refuse(writer: asyncio.StreamWriter, status: int, sentence: str) -> None:
    body = f"{sentence}\n".encode()
    head = (
        f"HTTP/1.1 {status} {http.client.responses[status]}\r\nContent-Type: text/plain\r\n"
        f"Content-Length: {len(body)}\r\nConnection: close\r\n\r\n"
    )
    writer.write(head.encode() + body)
    await writer.drain()


def _advertising(topic: str) -> bytes:
    """A client's frame (RFC 6455) that advertises a topic."""
    channel = {"id": CHANNEL, "topic": topic, "encoding": "json", "schemaName": ""}
    text = json.dumps({"op": "advertise", "channels": [channel]}).encode()
    mask = secrets.token_bytes(4)
    masked = bytes(octet ^ mask[i % 4] for i, octet in enumerate(text))
    return struct.pack(">BBH", 0x81, 0x80 | 126, len(text)) + mask + masked
