"""Publish messages from ordinary, blocking programs."""

import os
from collections.abc import Callable
from types import TracebackType
from typing import Any

import zmq

from sdrlinkd.client.blocking_socket import Endpoint
from sdrlinkd.client.deadline import Deadline
from sdrlinkd.client.errors import NoDaemonError, no_daemon, restarted
from sdrlinkd.client.messages import Receipt, sync_frames
from sdrlinkd.client.paths import IN_SOCKET, OUT_SOCKET, chosen_dir
from sdrlinkd.client.producer import STILL_THERE_S, Producer, wishes

RECONNECT_MS = 20
"""Shorter than the PUSH socket's 100 ms, so that a new daemon's announcement arrives first."""


class Publisher(Endpoint):
    """Hands messages to the local daemon, from one thread at a time.

    `send` blocks for at most `timeout_s` while the daemon is away or busy, then raises
    NoDaemonError; nothing is ever queued for an absent daemon. With a timeout of 0 it never blocks,
    which suits callbacks that must not delay their node, such as those of a ROS 2 executor; with
    `wait=False` it returns False instead of raising.

    The publisher refuses what the daemon would refuse, with the daemon's error texts and the limits
    that the daemon announces, also after a restart with other limits. With `checked=False` it does
    not check topics, types and sizes; the daemon's ledger then counts the refused messages. This is
    for measurements.
    """

    def __init__(
        self,
        runtime_dir: str | os.PathLike[str] | None = None,
        timeout_s: float = 5.0,
        *,
        checked: bool = True,
        directory: str | os.PathLike[str] | None = None,
    ) -> None:
        """Make a publisher without waiting for the daemon; see `wait_for_daemon`.

        `runtime_dir` is where the daemon's sockets are; `directory` is an alias of it.
        """
        super().__init__(zmq.PUSH, chosen_dir(runtime_dir, directory))
        self._socket.immediate = True
        self._timeout_s = timeout_s
        self._producer = Producer(checked)
        self._sent = False
        self._told = self._context.socket(zmq.SUB)
        self._told.rcvhwm = 0
        self._told.reconnect_ivl = RECONNECT_MS
        for topic in self._producer.topics:
            self._told.subscribe(topic)
        self._connect(OUT_SOCKET, self._told)
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
        key: str | None = None,
        published_ns: int | None = None,
        receipt: bool = False,
        timeout_s: float | None = None,
        wait: bool = True,
    ) -> str | bool | None:
        """Publish `cdr` under `topic`. Options left out come from the daemon's configuration.

        The message's age counts from `published_ns` (ns since 1970), or from now. `key` tells the
        streams of one topic apart, as those of several publishers: `depth` and `durability` apply
        to each. With `receipt`, each robot that the message is for reports what became of it, and
        `send` returns the id of these receipts; see the method `receipt`.

        Blocks for at most `timeout_s` (default: the publisher's). With 0 it never blocks, and
        raises NoDaemonError at once if the daemon is not connected (yet) or does not keep up. With
        `wait=False` it never blocks either, and returns False instead; the publisher connects again
        by itself. It then returns the receipt's id, or else True, for a message handed over.
        Raises MessageRefusedError for a message that the daemon does not accept: an unknown topic,
        a type other than the registry's, too large a message, or a value out of range.
        """
        fields = wishes(qos, priority, dst, lifespan_ms, type, published_ns, key)
        if wait:
            wait_s = self._timeout_s if timeout_s is None else timeout_s
            return self._send(topic, cdr, fields, published_ns, receipt, Deadline(wait_s))
        try:
            return self._send(topic, cdr, fields, published_ns, receipt, Deadline(0)) or True
        except NoDaemonError:
            return False

    def _send(
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
            self._hear()
        if not producer.takes(topic, cdr, type_):
            # Ask before refusing: a restarted daemon may accept other topics.
            self._ask(deadline)
            producer.check(topic, cdr, type_)
        name = None
        if receipt:
            if not producer.is_subscribed:
                self._ask(deadline, must_answer=True)
            name = fields["id"] = producer.awaited.new_id()
        frames = producer.encode(topic, cdr, fields, published_ns)
        while True:
            try:
                self._socket.send_multipart(frames, zmq.NOBLOCK)
                break
            except zmq.Again:
                if not (deadline.left_s and self._socket.poll(deadline.left_ms, zmq.POLLOUT)):
                    raise no_daemon(self.runtime_dir) from None
                # Another daemon may be listening by now.
                self._ask(deadline, must_answer=receipt)
                producer.check(topic, cdr, type_)
        self._sent = True
        if name is not None:
            producer.awaited.expect(name, topic, fields["d"], producer.boot)
        return name

    def receipt(self, timeout_s: float | None = None) -> Receipt | None:
        """The next receipt of the messages sent with `receipt`.

        None after `timeout_s`, or when no receipt is outstanding. Every message gets its receipts:
        if its daemon has ended or has not answered for 6 s, the fate is `unknown`.
        """
        awaited, deadline = self._producer.awaited, Deadline(timeout_s)
        while awaited:
            self._hear()
            if (came := awaited.next(self._producer.boot)) is not None:
                return came
            left_s = deadline.left_s
            if not left_s:
                return None
            self._until(lambda: awaited.has_come, Deadline(min(left_s, STILL_THERE_S)))
        return None

    def wait_for_daemon(self, timeout_s: float | None = None) -> None:
        """Wait until the daemon answers and takes messages, for at most `timeout_s`.

        The default is the publisher's. From then on, `send` need not wait. Raises NoDaemonError.
        """
        deadline = Deadline(self._timeout_s if timeout_s is None else timeout_s)
        self._ask(deadline, must_answer=True)
        if not self._socket.poll(deadline.left_ms, zmq.POLLOUT):
            raise no_daemon(self.runtime_dir)

    def flush(self, timeout_s: float = 5.0) -> None:
        """Wait until the daemon has received everything sent. Raises NoDaemonError.

        Messages that a daemon had received before it was killed are lost, and `flush` cannot detect
        that; request receipts where it matters.

        Without a flush, ZeroMQ may drop the last messages when the program ends right after many
        sends. Leaving the `with` block without an error flushes.
        """
        deadline = Deadline(timeout_s)
        question = self._question()
        answers = self._producer.answers(question)
        try:
            if not self._until(lambda: bool(answers), deadline):
                raise no_daemon(self.runtime_dir)
            if not self._socket.poll(deadline.left_ms, zmq.POLLOUT):
                raise no_daemon(self.runtime_dir)
            self._socket.send_multipart(sync_frames(question), zmq.NOBLOCK)
            if not self._until(lambda: len(answers) > 1, deadline):
                raise no_daemon(self.runtime_dir)
        except zmq.Again:
            raise no_daemon(self.runtime_dir) from None
        finally:
            self._answered(question)
        # A second boot id means that a restarted daemon answered, too.
        if len(set(answers)) > 1:
            raise restarted(self.runtime_dir)

    def close(self) -> None:
        """Close the sockets; messages sent have 200 ms to leave."""
        self._told.close()
        super().close()

    def _ask(self, deadline: Deadline, *, must_answer: bool = False) -> None:
        """Ask the daemon what it accepts now. Raises NoDaemonError when no answer comes in time.

        With no time left, use the last announcement; with `must_answer`, only if it is confirmed.
        """
        producer = self._producer
        if not deadline.left_s:
            self._hear()
            if producer.known is None or (must_answer and not producer.is_subscribed):
                raise no_daemon(self.runtime_dir)
            return
        question = self._question()
        answered = self._until(lambda: bool(producer.answers(question)), deadline)
        self._answered(question)
        if not answered:
            raise no_daemon(self.runtime_dir)

    def _question(self) -> bytes:
        topic = self._producer.ask()
        self._told.subscribe(topic)
        return topic

    def _answered(self, question: bytes) -> None:
        self._told.unsubscribe(question)
        self._producer.forget(question)

    def _until(self, is_done: Callable[[], bool], deadline: Deadline) -> bool:
        """Take the daemon's messages until `is_done`; False if the deadline came first."""
        while not is_done():
            if not self._told.poll(deadline.left_ms):
                return False
            self._hear()
        return True

    def _hear(self) -> None:
        """Take what the daemon has sent so far, without waiting."""
        try:
            while True:
                self._producer.take(self._told.recv_multipart(zmq.NOBLOCK))
        except zmq.Again:
            pass
        begin, done = self._producer.unprompted()
        if begin is not None:
            self._told.subscribe(begin)
        elif done is not None:
            self._told.unsubscribe(done)

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
