"""A Zenoh session for programs on an asyncio event loop.

Zenoh calls back from threads of its own. Here every callback runs on the loop, in the order of
arrival, from a queue that is bounded.
"""

import asyncio
import contextlib
import logging
import threading
from collections import deque
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import zenoh
import zenoh.ext

from sdrlinkd.config import FleetParams
from sdrlinkd.errors import UserError
from sdrlinkd.fleet.putting import Lane
from sdrlinkd.fleet.samples import Answer, Putter, Question, Sample
from sdrlinkd.fleet.zenoh_config import cause, make_zenoh_config

MOST_WAITING = 8192
MOST_QUERIES = 64
UNREACHED = "Unable to connect"
"""In Zenoh's error where no router answers."""
TRY_AGAIN_S = 0.5
AT_ONCE = 256
"""Callbacks that run before the loop does other work."""

_log = logging.getLogger(__name__)

_QOS = {
    "urgent": (zenoh.Priority.REAL_TIME, True, zenoh.CongestionControl.BLOCK),
    "latency": (zenoh.Priority.INTERACTIVE_HIGH, True, zenoh.CongestionControl.BLOCK),
    "default": (zenoh.Priority.DATA, False, zenoh.CongestionControl.BLOCK),
    "bulk": (zenoh.Priority.BACKGROUND, False, zenoh.CongestionControl.DROP),
}


class Session:
    """A Zenoh session on the running event loop. It finds a router again by itself."""

    def __init__(
        self, session: zenoh.Session, config: zenoh.Config, loop: asyncio.AbstractEventLoop
    ) -> None:
        self._session = session
        self.config = config
        """With which it was opened."""
        self._loop = loop
        self._waiting: deque[Callable[[], None]] = deque()
        self._is_draining = False
        self._lock = threading.Lock()
        """Of what Zenoh's threads change: what waits, and the counters below."""
        self._may_query = threading.BoundedSemaphore(MOST_QUERIES)
        self._lanes = {name: Lane(f"zenoh-{name}") for name in ("block", "drop")}
        self._answers = Lane("zenoh-answers", MOST_QUERIES)
        self._replies = Lane("zenoh-replies")
        self._transports = 0
        self._declared: list[Any] = []
        self.on_reach: Callable[[bool], None] = lambda _is_reached: None
        """Called when the first other Zenoh node is reached, and when the last one has gone."""
        self.overrun = 0
        """Samples dropped because this program could not keep up."""
        self.queries_refused = 0
        """Queries refused because too many waited."""
        self._declared.append(
            session.info.declare_transport_events_listener(self._note_transport, history=True)
        )

    @property
    def zid(self) -> str:
        """The id of the session, as it stands in keys."""
        return str(self._session.zid())

    @property
    def is_reached(self) -> bool:
        """Whether another Zenoh node is connected."""
        return self._transports > 0

    @property
    def failed(self) -> int:
        """Puts that Zenoh refused."""
        return sum(lane.failed for lane in self._lanes.values())

    def put(
        self, key: str, payload: bytes, attachment: bytes | None, qos: str,
        encoding: str | None = None,
    ) -> bool:  # fmt: skip
        """Put a value with the priority of class `qos`; False if too many puts wait."""
        priority, express, congestion = _QOS.get(qos, _QOS["default"])
        lane = "block" if congestion is zenoh.CongestionControl.BLOCK else "drop"
        return self._lanes[lane].offer(
            lambda: self._session.put(
                key, payload, attachment=attachment, priority=priority, express=express,
                congestion_control=congestion, encoding=encoding,
            )
        )  # fmt: skip

    def publisher(self, key: str, qos: str, encoding: str, kept: int) -> Putter:
        """What puts values at `key` with the priority of class `qos`.

        With `kept` above 0, subscribers that come later get the last values.
        """
        if not kept:
            return Putter(
                lambda payload, attachment: self.put(key, payload, attachment, qos, encoding),
                lambda: None,
            )
        priority, express, congestion = _QOS.get(qos, _QOS["default"])
        publisher = zenoh.ext.declare_advanced_publisher(
            self._session, key, priority=priority, express=express, congestion_control=congestion,
            encoding=encoding, cache=zenoh.ext.CacheConfig(max_samples=kept),
            publisher_detection=True,
        )  # fmt: skip
        end = self._keep(publisher)
        lane = self._lanes["block" if congestion is zenoh.CongestionControl.BLOCK else "drop"]
        return Putter(
            lambda payload, attachment: lane.offer(
                lambda: publisher.put(payload, attachment=attachment)
            ),
            end,
        )

    def subscribe(self, key: str, take: Callable[[Sample], None]) -> Callable[[], None]:
        """Call `take` for each value that others put at `key`; returns what ends that."""

        def heard(sample: zenoh.Sample) -> None:
            if sample.kind != zenoh.SampleKind.PUT:
                return
            attachment = None if sample.attachment is None else sample.attachment.to_bytes()
            payload, encoding = sample.payload.to_bytes(), str(sample.encoding)
            told = Sample(str(sample.key_expr), payload, attachment, encoding)
            self._post(lambda: take(told))

        others = zenoh.Locality.REMOTE
        return self._keep(self._session.declare_subscriber(key, heard, allowed_origin=others))

    def watch(self, key: str, take: Callable[[str, bool], None]) -> Callable[[], None]:
        """Call `take` with the key of each token, and whether it is there."""

        def heard(sample: zenoh.Sample) -> None:
            told, is_there = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
            self._post(lambda: take(told, is_there))

        liveliness = self._session.liveliness()
        return self._keep(liveliness.declare_subscriber(key, heard, history=True))

    def token(self, key: str) -> Callable[[], None]:
        """Set up a liveliness token; returns what takes it down."""
        return self._keep(self._session.liveliness().declare_token(key))

    def answer(self, key: str, answers: Callable[[str], Iterable[Answer]]) -> Callable[[], None]:
        """Answer queries that intersect `key`: `answers` gets the key that was asked for."""

        def asked(query: zenoh.Query) -> None:
            if self._may_query.acquire(blocking=False):
                with contextlib.suppress(RuntimeError):  # the loop has ended
                    self._loop.call_soon_threadsafe(self._answer, query, answers)
                return
            with self._lock:
                self.queries_refused += 1
            query.reply_err(b"too many queries; ask again later")
            query.drop()  # type: ignore[no-untyped-call]

        return self._keep(self._session.declare_queryable(key, asked))

    def serve(self, key: str, take: Callable[[Question], None]) -> Callable[[], None]:
        """Call `take` with each query at `key`; returns what ends that."""

        def asked(query: zenoh.Query) -> None:
            def reply(payload: bytes, attachment: bytes | None) -> None:
                def send() -> None:
                    query.reply(query.key_expr, payload, attachment=attachment)
                    query.drop()  # type: ignore[no-untyped-call]

                self._replies.offer(send)

            def drop() -> None:
                self._replies.offer(query.drop)

            payload = b"" if query.payload is None else query.payload.to_bytes()
            attachment = None if query.attachment is None else query.attachment.to_bytes()
            question = Question(payload, attachment, reply, drop)
            self._post(lambda: take(question))

        # All calls are for this one server, as rmw_zenoh asks those that are complete.
        return self._keep(self._session.declare_queryable(key, asked, complete=True))

    async def get(self, key: str, within_s: float) -> list[Answer]:
        """The answers to a query that come within so many seconds."""

        def ask() -> list[Answer]:
            replies = self._session.get(key, timeout=within_s)
            return [_answer(each.ok) for each in replies if each.ok is not None]

        return await asyncio.to_thread(ask)

    async def close(self) -> None:
        """Take everything down; what was put has a moment to leave."""
        for each in (*self._lanes.values(), self._answers, self._replies):
            await asyncio.to_thread(each.close)
        await asyncio.to_thread(self._session.close)

    def _keep(self, declared: Any) -> Callable[[], None]:  # noqa: ANN401 (several types)
        # Without a reference, Zenoh would take it down.
        self._declared.append(declared)

        def end() -> None:
            if declared in self._declared:
                self._declared.remove(declared)
                with contextlib.suppress(zenoh.ZError):
                    declared.undeclare()

        return end

    def _answer(self, query: zenoh.Query, answers: Callable[[str], Iterable[Answer]]) -> None:
        try:
            found = list(answers(str(query.key_expr)))
        except BaseException:
            # Or whoever asks would wait until garbage is collected.
            query.drop()  # type: ignore[no-untyped-call]
            self._may_query.release()
            raise

        def reply() -> None:
            try:
                for key, payload, attachment in found:
                    query.reply(key, payload, attachment=attachment)
            finally:
                query.drop()  # type: ignore[no-untyped-call]
                self._may_query.release()

        self._answers.offer(reply)  # It has room for MOST_QUERIES.

    def _post(self, action: Callable[[], None]) -> None:
        """Have `action` run on the loop; called by Zenoh's threads."""
        with self._lock:
            if len(self._waiting) >= MOST_WAITING:
                self.overrun += 1
                return
            self._waiting.append(action)
            is_draining, self._is_draining = self._is_draining, True
        if not is_draining:
            with contextlib.suppress(RuntimeError):  # the loop has ended
                self._loop.call_soon_threadsafe(self._drain)

    def _drain(self) -> None:
        with self._lock:
            n = min(len(self._waiting), AT_ONCE)
            actions = [self._waiting.popleft() for _ in range(n)]
            self._is_draining = n > 0
        for action in actions:
            try:
                action()
            except Exception as error:
                told = {"message": "a callback of Zenoh's failed", "exception": error}
                self._loop.call_exception_handler(told)
        if actions:
            self._loop.call_soon(self._drain)

    def _note_transport(self, event: zenoh.TransportEvent) -> None:
        is_new = event.kind == zenoh.SampleKind.PUT
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._count_transport, 1 if is_new else -1)

    def _count_transport(self, change: int) -> None:
        was_reached = self.is_reached
        self._transports += change
        if self.is_reached != was_reached:
            self.on_reach(self.is_reached)


def _answer(sample: zenoh.Sample) -> Answer:
    attachment = None if sample.attachment is None else sample.attachment.to_bytes()
    return Answer(str(sample.key_expr), sample.payload.to_bytes(), attachment)


async def open_session(params: FleetParams, folder: Path) -> Session:
    """Open a session as `[fleet]` says, once a router is there.

    File names are relative to `folder`. Raises UserError.
    """
    config = make_zenoh_config(params, folder)
    is_told = False
    while True:
        try:
            session = await asyncio.to_thread(zenoh.open, config)
            return Session(session, config, asyncio.get_running_loop())
        except zenoh.ZError as error:
            if UNREACHED not in str(error):
                raise UserError(f"Zenoh cannot be opened: {cause(error)}") from None
            if not is_told:
                _log.warning("no Zenoh router is reached (%s); waiting for one", cause(error))
            is_told = True
            await asyncio.sleep(TRY_AGAIN_S)
