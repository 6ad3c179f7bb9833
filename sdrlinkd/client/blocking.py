"""Publish and subscribe from ordinary, blocking programs."""

import math
import os
import time
from collections.abc import Iterator
from types import TracebackType
from typing import Self

import zmq

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

RECEIVE_HWM = 1000
LINGER_MS = 200


class NoDaemonError(ConnectionError):
    """No sdrlinkd listens there."""


def no_daemon(directory: object) -> NoDaemonError:
    """The error for a runtime directory without a daemon."""
    return NoDaemonError(
        f"no sdrlinkd answers in {directory}; start one (sdrlinkd --config FILE), or name its "
        "directory with SDRLINKD_RUNTIME_DIR; a service's is open to members of its group only"
    )


class Endpoint:
    """A ZeroMQ socket in its own context, closed by `with`."""

    def __init__(self, kind: int, directory: str | os.PathLike[str] | None) -> None:
        self.directory = runtime_dir(directory)
        self._context = zmq.Context()
        self._socket = self._context.socket(kind)
        self._socket.linger = LINGER_MS

    def _connect(self, name: str) -> None:
        try:
            self._socket.connect(endpoint(self.directory, name))
        except zmq.ZMQError:
            self.close()
            raise no_daemon(self.directory) from None

    def _poll(self, timeout_s: float | None) -> bool:
        timeout_ms = None if timeout_s is None else math.ceil(timeout_s * 1000)
        return bool(self._socket.poll(timeout_ms))

    def close(self) -> None:
        """Close the socket; what was sent has 200 ms to leave."""
        self._socket.close()
        self._context.term()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


class Publisher(Endpoint):
    """Hands messages to the local daemon.

    `send` blocks for at most `timeout_s` while the daemon is away or busy, then raises
    NoDaemonError: nothing is ever queued for a daemon that is not there.
    """

    def __init__(
        self, directory: str | os.PathLike[str] | None = None, timeout_s: float = 5.0
    ) -> None:
        super().__init__(zmq.PUSH, directory)
        self._socket.immediate = True
        self._socket.sndtimeo = int(timeout_s * 1000)
        self._sent = False
        self._ids = ReceiptIds()
        self._receipts: zmq.Socket[bytes] | None = None
        self._connect(IN_SOCKET)

    def send(
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
        """Publish `cdr` under `topic`. What is left out comes from the daemon's configuration.

        Its age counts from `published_ns` since 1970, else from now. With `receipt`, each robot
        that it is for answers what became of it, under the name that is returned; see the method
        `receipt`.
        """
        fields = {
            "q": qos, "p": priority, "d": dst, "ls": lifespan_ms, "ty": type,
            "t": time.time_ns() if published_ns is None else published_ns,
        }  # fmt: skip
        name = None
        if receipt:
            if self._receipts is None:
                self._receipts = self._subscribed(self._ids.prefix)
            name = fields["id"] = self._ids.new()
        try:
            self._socket.send_multipart(encode_out(topic, cdr, fields))
            self._sent = True
        except zmq.Again:
            raise no_daemon(self.directory) from None
        return name

    def receipt(self, timeout_s: float | None = None) -> Receipt | None:
        """The next answer to messages sent with `receipt`; None when `timeout_s` passed first."""
        if self._receipts is None:
            return None
        timeout_ms = None if timeout_s is None else math.ceil(timeout_s * 1000)
        if not self._receipts.poll(timeout_ms):
            return None
        return decode_receipt(self._receipts.recv_multipart())

    def close(self) -> None:
        """Close the sockets; what was sent has 200 ms to leave."""
        if self._receipts is not None:
            self._receipts.close()
        super().close()

    def _subscribed(self, prefix: bytes, timeout_s: float = 5.0) -> zmq.Socket[bytes]:
        """A socket that misses nothing from now on. Raises NoDaemonError."""
        socket = self._context.socket(zmq.SUB)
        socket.connect(endpoint(self.directory, OUT_SOCKET))
        ack_topic = new_ack_topic()
        socket.subscribe(prefix)
        socket.subscribe(ack_topic)
        if not socket.poll(math.ceil(timeout_s * 1000)):
            socket.close()
            raise no_daemon(self.directory)
        socket.recv_multipart()
        socket.unsubscribe(ack_topic)
        return socket

    def flush(self, timeout_s: float = 5.0) -> None:
        """Wait until the daemon has taken everything sent. Raises NoDaemonError.

        ZeroMQ may drop the end of a long burst when the sender goes at once; who leaves the
        `with` block in peace has flushed.
        """
        ack_topic = new_ack_topic()
        with self._context.socket(zmq.SUB) as answers:
            answers.connect(endpoint(self.directory, OUT_SOCKET))
            answers.subscribe(ack_topic)
            for step in ("subscribed", "taken"):
                if not answers.poll(math.ceil(timeout_s * 1000)):
                    raise no_daemon(self.directory)
                answers.recv_multipart()
                if step == "subscribed":
                    try:
                        self._socket.send_multipart(sync_frames(ack_topic))
                    except zmq.Again:
                        raise no_daemon(self.directory) from None

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if error is None and self._sent:
                self.flush()
        finally:
            self.close()


class Subscriber(Endpoint):
    """Receives what other robots sent. A topic that ends with `*` is a prefix.

    `depth` messages wait for a slow reader, 0: without bound; what is beyond is missing, and shows
    as a step in `Message.number`.
    """

    def __init__(
        self,
        *topics: str,
        directory: str | os.PathLike[str] | None = None,
        timeout_s: float = 5.0,
        depth: int = RECEIVE_HWM,
    ) -> None:
        super().__init__(zmq.SUB, directory)
        self._socket.rcvhwm = depth
        self._connect(OUT_SOCKET)
        for topic in topics or ("/*",):
            self._socket.subscribe(topic_filter(topic))
        self._wait_until_subscribed(timeout_s)

    def receive(self, timeout_s: float | None = None) -> Message | None:
        """The next message; None when `timeout_s` passed without one."""
        deadline = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            if not self._poll(None if deadline is None else max(0.0, deadline - time.monotonic())):
                return None
            message = decode_in(self._socket.recv_multipart())
            if message is not None:
                return message

    def __iter__(self) -> Iterator[Message]:
        while True:
            message = self.receive()
            if message is not None:
                yield message

    def _wait_until_subscribed(self, timeout_s: float) -> None:
        """The daemon answers subscriptions in order, so its answer to ours means all are active."""
        token = new_ack_topic()
        self._socket.subscribe(token)
        deadline = time.monotonic() + timeout_s
        while (left_s := deadline - time.monotonic()) > 0:
            if self._poll(left_s) and self._socket.recv_multipart()[0] == token:
                self._socket.unsubscribe(token)
                return
        self.close()
        raise no_daemon(self.directory)
