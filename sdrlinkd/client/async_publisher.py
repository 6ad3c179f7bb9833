"""Publish messages from asyncio programs."""

import asyncio
import os
from collections.abc import Callable
from types import TracebackType
from typing import Any

import zmq
import zmq.asyncio

from sdrlinkd.client.async_socket import AsyncSocket
from sdrlinkd.client.deadline import Deadline
from sdrlinkd.client.errors import NoDaemonError, no_daemon, restarted
from sdrlinkd.client.messages import Receipt, sync_frames
from sdrlinkd.client.paths import IN_SOCKET, OUT_SOCKET, chosen_dir, endpoint
from sdrlinkd.client.producer import STILL_THERE_S, Producer, wishes
from sdrlinkd.client.publisher import RECONNECT_MS

# Runs on Python 3.10, which lacks asyncio.timeout and has an asyncio.TimeoutError of its own.


class AsyncPublisher(AsyncSocket):
    """A `Publisher` that awaits instead of blocking, for all tasks of one asyncio event loop."""

    def __init__(
        self,
        runtime_dir: str | os.PathLike[str] | None = None,
        timeout_s: float = 5.0,
        *,
        checked: bool = True,
        directory: str | os.PathLike[str] | None = None,
    ) -> None:
        super().__init__(zmq.PUSH, chosen_dir(runtime_dir, directory), timeout_s)
        self._socket.immediate = True
        self._sent = False
        self._producer = Producer(checked)
        self._told = self._context.socket(zmq.SUB)
        self._told.rcvhwm = 0
        self._told.reconnect_ivl = RECONNECT_MS
        self._is_listening = False
        self._news = asyncio.Event()
        for topic in self._producer.topics:
            self._told.subscribe(topic)
        self._told.connect(endpoint(self.runtime_dir, OUT_SOCKET))
        self._socket.connect(endpoint(self.runtime_dir, IN_SOCKET))

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
        key: str | None = None,
        published_ns: int | None = None,
        receipt: bool = False,
        timeout_s: float | None = None,
        wait: bool = True,
    ) -> str | bool | None:
        """Publish `cdr` under `topic`; with `receipt`, returns the message's id.

        As `Publisher.send`, it raises NoDaemonError after the timeout (at once when that is 0) and
        MessageRefusedError for a message that the daemon does not accept. With `wait=False` it
        returns False instead of waiting, and True or the id for a message handed over.
        """
        fields = wishes(qos, priority, dst, lifespan_ms, type, published_ns, key)
        if wait:
            wait_s = self._timeout_s if timeout_s is None else timeout_s
            return await self._send(topic, cdr, fields, published_ns, receipt, Deadline(wait_s))
        try:
            return await self._send(topic, cdr, fields, published_ns, receipt, Deadline(0)) or True
        except NoDaemonError:
            return False

    async def _send(
        self,
        topic: str,
        cdr: bytes,
        fields: dict[str, Any],
        published_ns: int | None,
        receipt: bool,
        deadline: Deadline,
    ) -> str | None:
        """`send` until `deadline`, with the header `fields`."""
        producer, type_ = self._producer, fields["ty"]
        if producer.is_time_to_look():
            await self._hear()
        if not producer.takes(topic, cdr, type_):
            # Ask before refusing: a restarted daemon may accept other topics.
            await self._ask(deadline)
            producer.check(topic, cdr, type_)
        name = None
        if receipt:
            if not producer.is_subscribed:
                await self._ask(deadline, must_answer=True)
            name = fields["id"] = producer.awaited.new_id()
        frames = producer.encode(topic, cdr, fields, published_ns)
        while True:
            try:
                await self._socket.send_multipart(frames, zmq.NOBLOCK)
                break
            except zmq.Again:
                if not await self._is_writable(deadline):
                    raise no_daemon(self.runtime_dir) from None
                # Another daemon may be listening by now.
                await self._ask(deadline, must_answer=receipt)
                producer.check(topic, cdr, type_)
        self._sent = True
        if name is not None:
            producer.awaited.expect(name, topic, fields["d"], producer.boot)
        return name

    async def receipt(self, timeout_s: float | None = None) -> Receipt | None:
        """The next receipt of the messages sent with `receipt`, as `Publisher.receipt`.

        None after `timeout_s`, or when no receipt is outstanding.
        """
        awaited, deadline = self._producer.awaited, Deadline(timeout_s)
        while awaited:
            await self._hear()
            if (came := awaited.next(self._producer.boot)) is not None:
                return came
            left_s = deadline.left_s
            if not left_s:
                return None
            await self._until(lambda: awaited.has_come, Deadline(min(left_s, STILL_THERE_S)))
        # Let other tasks run, even if the caller polls in a loop.
        await asyncio.sleep(0)
        return None

    async def wait_for_daemon(self, timeout_s: float | None = None) -> None:
        """Wait until the daemon answers and takes messages, as `Publisher.wait_for_daemon`.

        Raises NoDaemonError.
        """
        deadline = Deadline(self._timeout_s if timeout_s is None else timeout_s)
        await self._ask(deadline, must_answer=True)
        if not await self._is_writable(deadline):
            raise no_daemon(self.runtime_dir)

    async def flush(self) -> None:
        """Wait until the daemon has received everything sent, as `Publisher.flush`.

        Raises NoDaemonError.
        """
        deadline, question = Deadline(self._timeout_s), self._question()
        answers = self._producer.answers(question)
        try:
            if not await self._until(lambda: bool(answers), deadline):
                raise no_daemon(self.runtime_dir)
            await asyncio.wait_for(
                self._socket.send_multipart(sync_frames(question)), deadline.left_or_none
            )
            if not await self._until(lambda: len(answers) > 1, deadline):
                raise no_daemon(self.runtime_dir)
        except asyncio.TimeoutError:
            raise no_daemon(self.runtime_dir) from None
        finally:
            self._answered(question)
        # A second boot id means that a restarted daemon answered, too.
        if len(set(answers)) > 1:
            raise restarted(self.runtime_dir)

    async def _ask(self, deadline: Deadline, *, must_answer: bool = False) -> None:
        """Ask the daemon what it accepts now. Raises NoDaemonError when no answer comes in time.

        With no time left, use the last announcement; with `must_answer`, only if it is confirmed.
        """
        producer = self._producer
        if not deadline.left_s:
            await self._hear()
            if producer.known is None or (must_answer and not producer.is_subscribed):
                raise no_daemon(self.runtime_dir)
            return
        question = self._question()
        answered = await self._until(lambda: bool(producer.answers(question)), deadline)
        self._answered(question)
        if not answered:
            raise no_daemon(self.runtime_dir)

    async def _is_writable(self, deadline: Deadline) -> bool:
        """Whether the socket becomes writable before the deadline."""
        poller = zmq.asyncio.Poller()
        poller.register(self._socket, zmq.POLLOUT)
        return bool(await poller.poll(deadline.left_ms))

    def _question(self) -> bytes:
        topic = self._producer.ask()
        self._told.subscribe(topic)
        return topic

    def _answered(self, question: bytes) -> None:
        self._told.unsubscribe(question)
        self._producer.forget(question)

    async def _until(self, is_done: Callable[[], bool], deadline: Deadline) -> bool:
        """Take the daemon's messages until `is_done`; False if the deadline came first."""

        async def listen() -> None:
            while not is_done():
                if self._is_listening:
                    # One task listens for all tasks and wakes them when something arrives.
                    await self._news.wait()
                    continue
                self._is_listening = True
                try:
                    await self._told.poll()
                    await self._drain()
                finally:
                    self._is_listening = False
                    news, self._news = self._news, asyncio.Event()
                    news.set()

        try:
            await asyncio.wait_for(listen(), deadline.left_or_none)
        except asyncio.TimeoutError:
            return is_done()
        return True

    async def _hear(self) -> None:
        """Take what the daemon has sent so far, without waiting, unless a task already listens."""
        # Taking a message that a listener polls for would not wake that listener.
        if not self._is_listening:
            await self._drain()

    async def _drain(self) -> None:
        try:
            while True:
                self._producer.take(await self._told.recv_multipart(zmq.NOBLOCK))
        except zmq.Again:
            pass
        begin, done = self._producer.unprompted()
        if begin is not None:
            self._told.subscribe(begin)
        elif done is not None:
            self._told.unsubscribe(done)

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
