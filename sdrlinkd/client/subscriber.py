"""Subscribe to messages from ordinary, blocking programs."""

import os
from collections.abc import Iterator

import zmq

from sdrlinkd.client.arrivals import Arrivals
from sdrlinkd.client.blocking_socket import Endpoint
from sdrlinkd.client.deadline import Deadline
from sdrlinkd.client.errors import no_daemon
from sdrlinkd.client.messages import Message, new_ack_topic, topic_filter
from sdrlinkd.client.paths import OUT_SOCKET, chosen_dir

RECEIVE_HWM = 1000
ASK_AGAIN_S = 0.2
KEPT_S = 1.0
"""Longest wait in s for kept messages after the answer."""


class Subscriber(Endpoint):
    """Receives messages from other robots. A topic that ends with `*` is a prefix.

    Up to `depth` messages wait for a slow reader (0: no limit). Messages beyond that are dropped,
    which shows as a step in `Message.number`. The first messages are those that the daemon has kept
    of `transient_local` topics (`Message.is_late`).
    """

    def __init__(
        self,
        *topics: str,
        runtime_dir: str | os.PathLike[str] | None = None,
        timeout_s: float = 5.0,
        depth: int = RECEIVE_HWM,
        directory: str | os.PathLike[str] | None = None,
    ) -> None:
        """Subscribe, and wait for the daemon for at most `timeout_s`. Raises NoDaemonError.

        `runtime_dir` is where the daemon's sockets are; `directory` is an alias of it.
        """
        super().__init__(zmq.SUB, chosen_dir(runtime_dir, directory))
        self._socket.rcvhwm = depth
        filters = [topic_filter(topic) for topic in topics or ("/*",)]
        self._arrivals = Arrivals(filters)
        self._requests = dict(zip(filters, self._arrivals.requests, strict=True))
        self._kept_until = Deadline(KEPT_S)
        self._connect(OUT_SOCKET)
        for each in (*filters, *self._arrivals.requests):
            self._socket.subscribe(each)
        try:
            self._wait_until_subscribed(timeout_s)
        except BaseException:
            self.close()
            raise

    def subscribe(self, topic: str) -> None:
        """Subscribe to a further topic; a prefix if it ends with `*`.

        Its first messages are those that the daemon has kept.
        """
        each = topic_filter(topic)
        request = self._arrivals.request(each)
        self._kept_until = Deadline(KEPT_S)
        self._requests[each] = request
        self._socket.subscribe(each)
        self._socket.subscribe(request)

    def unsubscribe(self, topic: str) -> None:
        """Take no more messages of a topic, which was named in the same words before.

        Who subscribes to it again gets what is kept then, again.
        """
        each = topic_filter(topic)
        self._arrivals.forget(each)
        self._socket.unsubscribe(each)
        if (request := self._requests.pop(each, None)) is not None:
            self._socket.unsubscribe(request)

    def receive(self, timeout_s: float | None = None) -> Message | None:
        """The next message; None if none arrives within `timeout_s`."""
        deadline, arrivals = Deadline(timeout_s), self._arrivals
        while (ready := arrivals.next()) is None:
            left_s = deadline.left_s
            if not arrivals.has_kept:
                left_s = min(left_s, self._kept_until.left_s)
            if self._poll(left_s):
                message = arrivals.take(self._socket.recv_multipart())
                if message is not None:
                    return message
            elif arrivals.has_kept or self._kept_until.left_s:
                return None
            else:
                arrivals.begin()
        return ready

    def __iter__(self) -> Iterator[Message]:
        while True:
            message = self.receive()
            if message is not None:
                yield message

    def _hold_kept(self) -> None:
        """Hold the kept messages that are still to come; they precede the answer if they can."""
        deadline = Deadline(KEPT_S)
        while not self._arrivals.has_kept and self._poll(deadline.left_s):
            self._arrivals.hold(self._socket.recv_multipart())

    def _wait_until_subscribed(self, timeout_s: float) -> None:
        """Wait until the daemon answers an ack topic: then all earlier subscriptions are active."""
        deadline, again, asked = Deadline(timeout_s), Deadline(0), list[bytes]()
        while deadline.left_s:
            if not again.left_s:
                # A full queue may drop the answer along with messages, so ask again.
                again = Deadline(ASK_AGAIN_S)
                asked.append(new_ack_topic())
                self._socket.subscribe(asked[-1])
            if not self._poll(min(again.left_s, deadline.left_s)):
                continue
            frames = self._socket.recv_multipart()
            if frames[0] in asked:
                self._hold_kept()
                self._arrivals.begin()
                for token in asked:
                    self._socket.unsubscribe(token)
                return
            self._arrivals.hold(frames)
        raise no_daemon(self.runtime_dir)
