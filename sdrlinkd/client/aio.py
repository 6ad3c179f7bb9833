"""Publish and subscribe from asyncio programs."""

import asyncio
import os
import time
from collections.abc import AsyncIterator
from types import TracebackType
from typing import Self

import zmq
import zmq.asyncio

from sdrlinkd.client.blocking import LINGER_MS, RECEIVE_HWM, no_daemon
from sdrlinkd.client.messages import (
    Message,
    Receipt,
    ReceiptIds,
    decode_in,
    decode_receipt,
    encode_out,
    new_ack_topic,
    sync_frames,
    topic_filter,
)
from sdrlinkd.client.paths import IN_SOCKET, OUT_SOCKET, endpoint, runtime_dir


class _AsyncSocket:
    """A ZeroMQ socket in its own context, closed by `async with`."""

    def __init__(
        self, kind: int, directory: str | os.PathLike[str] | None, timeout_s: float
    ) -> None:
        self.directory = runtime_dir(directory)
        self._timeout_s = timeout_s
        self._context = zmq.asyncio.Context()
        self._socket = self._context.socket(kind)

    async def close(self) -> None:
        """Close the sockets; what was sent has 200 ms to leave."""
        self._context.destroy(LINGER_MS)

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        await self.close()


class AsyncPublisher(_AsyncSocket):
    """As `Publisher`, awaiting instead of blocking."""

    def __init__(
        self, directory: str | os.PathLike[str] | None = None, timeout_s: float = 5.0
    ) -> None:
        super().__init__(zmq.PUSH, directory, timeout_s)
        self._socket.immediate = True
        self._sent = False
        self._ids = ReceiptIds()
        self._receipts: zmq.asyncio.Socket | None = None
        self._subscribing = asyncio.Lock()
        self._socket.connect(endpoint(self.directory, IN_SOCKET))

    async def send(
        self,
        topic: str,
        cdr: bytes,
        *,
        qos: str | None = None,
        priority: int | None = None,
        dst: int | None = None,
        lifespan_ms: float | None = None,
        type: str | None = None,  # noqa: A002
        published_ns: int | None = None,
        receipt: bool = False,
    ) -> str | None:
        """Publish `cdr` under `topic`; with `receipt`, the name under which it is answered.

        Raises NoDaemonError after the timeout.
        """
        fields = {
            "q": qos, "p": priority, "d": dst, "ls": lifespan_ms, "ty": type,
            "t": time.time_ns() if published_ns is None else published_ns,
        }  # fmt: skip
        name = None
        if receipt:
            async with self._subscribing:
                if self._receipts is None:
                    self._receipts = await self._subscribed(self._ids.prefix)
            name = fields["id"] = self._ids.new()
        try:
            async with asyncio.timeout(self._timeout_s):
                await self._socket.send_multipart(encode_out(topic, cdr, fields))
            self._sent = True
        except TimeoutError:
            raise no_daemon(self.directory) from None
        return name

    async def receipt(self, timeout_s: float | None = None) -> Receipt | None:
        """The next answer to messages sent with `receipt`; None when `timeout_s` passed first."""
        if self._receipts is None:
            return None
        try:
            async with asyncio.timeout(timeout_s):
                return decode_receipt(await self._receipts.recv_multipart())
        except TimeoutError:
            return None

    async def _subscribed(self, prefix: bytes) -> zmq.asyncio.Socket:
        """A socket that misses nothing from now on. Raises NoDaemonError."""
        socket = self._context.socket(zmq.SUB)
        socket.connect(endpoint(self.directory, OUT_SOCKET))
        ack_topic = new_ack_topic()
        socket.subscribe(prefix)
        socket.subscribe(ack_topic)
        try:
            async with asyncio.timeout(self._timeout_s):
                await socket.recv_multipart()
        except TimeoutError:
            socket.close()
            raise no_daemon(self.directory) from None
        socket.unsubscribe(ack_topic)
        return socket

    async def flush(self) -> None:
        """Wait until the daemon has taken everything sent. Raises NoDaemonError."""
        ack_topic = new_ack_topic()
        with self._context.socket(zmq.SUB) as answers:
            answers.connect(endpoint(self.directory, OUT_SOCKET))
            answers.subscribe(ack_topic)
            try:
                async with asyncio.timeout(self._timeout_s):
                    await answers.recv_multipart()
                    await self._socket.send_multipart(sync_frames(ack_topic))
                    await answers.recv_multipart()
            except TimeoutError:
                raise no_daemon(self.directory) from None

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if error is None and self._sent:
                await self.flush()
        finally:
            await self.close()


class AsyncSubscriber(_AsyncSocket):
    """As `Subscriber`, an asynchronous iterator; enter it with `async with`."""

    def __init__(
        self,
        *topics: str,
        directory: str | os.PathLike[str] | None = None,
        timeout_s: float = 5.0,
    ) -> None:
        super().__init__(zmq.SUB, directory, timeout_s)
        self._topics = topics or ("/*",)
        self._socket.rcvhwm = RECEIVE_HWM

    async def __aenter__(self) -> Self:
        self._socket.connect(endpoint(self.directory, OUT_SOCKET))
        token = new_ack_topic()
        for topic in self._topics:
            self._socket.subscribe(topic_filter(topic))
        self._socket.subscribe(token)
        try:
            async with asyncio.timeout(self._timeout_s):
                while (await self._socket.recv_multipart())[0] != token:
                    pass
        except TimeoutError:
            await self.close()
            raise no_daemon(self.directory) from None
        self._socket.unsubscribe(token)
        return self

    async def receive(self) -> Message:
        """The next message."""
        while True:
            message = decode_in(await self._socket.recv_multipart())
            if message is not None:
                return message

    async def __aiter__(self) -> AsyncIterator[Message]:
        while True:
            yield await self.receive()
