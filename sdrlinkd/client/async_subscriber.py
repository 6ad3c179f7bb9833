"""Subscribe to messages from asyncio programs."""

import asyncio
import os
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING

import zmq

from sdrlinkd.client.arrivals import Arrivals
from sdrlinkd.client.async_socket import AsyncSocket
from sdrlinkd.client.deadline import Deadline
from sdrlinkd.client.errors import no_daemon
from sdrlinkd.client.messages import Message, new_ack_topic, topic_filter
from sdrlinkd.client.paths import OUT_SOCKET, chosen_dir, endpoint
from sdrlinkd.client.subscriber import ASK_AGAIN_S, KEPT_S, RECEIVE_HWM

if TYPE_CHECKING:
    from typing_extensions import Self


class AsyncSubscriber(AsyncSocket):
    """A `Subscriber` for asyncio: an asynchronous iterator, to be entered with `async with`."""

    def __init__(
        self,
        *topics: str,
        runtime_dir: str | os.PathLike[str] | None = None,
        timeout_s: float = 5.0,
        directory: str | os.PathLike[str] | None = None,
    ) -> None:
        super().__init__(zmq.SUB, chosen_dir(runtime_dir, directory), timeout_s)
        self._socket.rcvhwm = RECEIVE_HWM
        self._filters = [topic_filter(topic) for topic in topics or ("/*",)]
        self._arrivals = Arrivals(self._filters)

    async def __aenter__(self) -> "Self":
        self._socket.connect(endpoint(self.runtime_dir, OUT_SOCKET))
        for each in (*self._filters, *self._arrivals.requests):
            self._socket.subscribe(each)
        try:
            await asyncio.wait_for(self._subscribed(), self._timeout_s)
        except asyncio.TimeoutError:
            await self.close()
            raise no_daemon(self.runtime_dir) from None
        except BaseException:
            await self.close()
            raise
        return self

    async def _subscribed(self) -> None:
        again, asked = Deadline(0), list[bytes]()
        while True:
            if not again.left_s:
                # A full queue may drop the answer along with messages, so ask again.
                again = Deadline(ASK_AGAIN_S)
                asked.append(new_ack_topic())
                self._socket.subscribe(asked[-1])
            if not await self._socket.poll(again.left_ms):
                continue
            frames = await self._socket.recv_multipart()
            if frames[0] in asked:
                break
            self._arrivals.hold(frames)
        deadline = Deadline(KEPT_S)
        while not self._arrivals.has_kept and await self._socket.poll(deadline.left_ms):
            self._arrivals.hold(await self._socket.recv_multipart())
        self._arrivals.begin()
        for token in asked:
            self._socket.unsubscribe(token)

    async def receive(self) -> Message:
        """Wait for the next message and return it."""
        if (first := self._arrivals.next()) is not None:
            return first
        while True:
            message = self._arrivals.admit(await self._socket.recv_multipart())
            if message is not None:
                return message

    async def __aiter__(self) -> AsyncIterator[Message]:
        while True:
            yield await self.receive()
