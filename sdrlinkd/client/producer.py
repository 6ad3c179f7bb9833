"""The state of a producer's conversation with its daemon, without a socket.

The publishers own the sockets and pass the frames. One subscription carries announcements,
acknowledgements and receipts, in the order in which the daemon sent them.
"""

import time
from collections.abc import Sequence
from typing import Any

from sdrlinkd.client.announced import Announced, check_wishes
from sdrlinkd.client.awaited import AwaitedReceipts
from sdrlinkd.client.errors import EnvelopeMismatchError
from sdrlinkd.client.flatmap import Value, pack_map, unpack
from sdrlinkd.client.messages import (
    ACK_PREFIX,
    ENVELOPE_VERSION,
    RECEIPT_PREFIX,
    WELCOME_PREFIX,
    decode_receipt,
    new_ack_topic,
)

LOOK_S = 0.02
"""Shortest time in s between two checks for news from the daemon."""

STILL_THERE_S = 1.0
"""Silence in s after which a producer that awaits receipts probes the daemon."""
GONE_S = 5.0
"""Time in s without an answer to a probe after which the daemon counts as gone."""


class Producer:
    """One producer's side of the protocol. With `is_checked`, it refuses what the daemon would."""

    def __init__(self, is_checked: bool) -> None:
        self._is_checked = is_checked
        self._look_at = 0.0
        self._questions: dict[bytes, list[str]] = {}
        """Boot ids of the daemons that answered, by ack topic."""
        self._unprompted: bytes | None = None
        self._unprompted_at = self._heard_at = time.monotonic()
        self._confirmed = ""
        """Boot id of the daemon that has confirmed our subscriptions."""
        self.known: Announced | None = None
        self.awaited = AwaitedReceipts()

    @property
    def topics(self) -> tuple[bytes, ...]:
        """Topics that a producer subscribes to from the start."""
        return WELCOME_PREFIX, self.awaited.prefix

    def is_time_to_look(self) -> bool:
        """Whether the last check of the socket is at least LOOK_S ago; if so, note a new one."""
        now = time.monotonic()
        if now < self._look_at:
            return False
        self._look_at = now + LOOK_S
        return True

    def take(self, frames: Sequence[bytes]) -> None:
        """Take frames that the daemon sent. Raises EnvelopeMismatchError."""
        topic = frames[0]
        self._heard_at = time.monotonic()
        try:
            if topic.startswith(RECEIPT_PREFIX):
                if (receipt := decode_receipt(frames)) is not None:
                    self.awaited.take(receipt)
                return
            told = topic.removeprefix(WELCOME_PREFIX) if len(frames) == 1 else frames[1][1:]
            known = Announced(unpack(told))
        except (ValueError, KeyError, TypeError, AttributeError):
            raise EnvelopeMismatchError(
                "the daemon uses another version of the announcement; update it or the client"
            ) from None
        self.known = known
        if topic.startswith(ACK_PREFIX):
            self._confirmed = known.boot
            self._questions.get(topic, []).append(known.boot)

    def ask(self) -> bytes:
        """A new ack topic; subscribing to it makes the daemon answer."""
        topic = new_ack_topic()
        self._questions[topic] = []
        return topic

    def answers(self, topic: bytes) -> list[str]:
        """Boot ids of the daemons that have answered on ack topic `topic` so far."""
        return self._questions[topic]

    def forget(self, topic: bytes) -> None:
        """Stop waiting for answers on ack topic `topic`."""
        self._questions.pop(topic, None)

    def unprompted(self) -> tuple[bytes | None, bytes | None]:
        """Ack topics to (subscribe to, unsubscribe from), for probes in the background.

        A probe finds out whether a new daemon has our subscriptions, and whether the daemon that
        owes us receipts still runs.
        """
        now = time.monotonic()
        if self._unprompted is not None:
            if not self._questions[self._unprompted]:
                if self.awaited and now - self._unprompted_at > GONE_S:
                    self.known = None
                return None, None
            done, self._unprompted = self._unprompted, None
            self.forget(done)
            return None, done
        is_silent = bool(self.awaited) and now - self._heard_at > STILL_THERE_S
        if self.known is not None and (is_silent or not self.is_subscribed):
            self._unprompted, self._unprompted_at = self.ask(), now
            return self._unprompted, None
        return None, None

    @property
    def is_subscribed(self) -> bool:
        """Whether the daemon has our subscriptions, so that no receipt can be missed."""
        return self.known is not None and self.known.boot == self._confirmed

    @property
    def boot(self) -> str:
        """Boot id of the known daemon; empty while none is known."""
        return "" if self.known is None else self.known.boot

    def takes(self, topic: str, cdr: bytes, type_: str | None) -> bool:
        """Whether the daemon accepts such a message, by its last announcement."""
        known = self.known
        if known is None:
            return False
        if not self._is_checked:
            return True
        return (
            4 <= len(cdr) <= known.most.get(topic, -1)
            and (type_ is None or type_ == known.types[topic])
        )  # fmt: skip

    def check(self, topic: str, cdr: bytes, type_: str | None) -> None:
        """Raise MessageRefusedError if the last announcement rules such a message out."""
        if self._is_checked and self.known is not None:
            self.known.check(topic, len(cdr), type_)

    def encode(
        self, topic: str, cdr: bytes, fields: dict[str, Value], published_ns: int | None
    ) -> list[bytes]:
        """The three frames of a message, stamped with `published_ns` or the present time."""
        given = {key: value for key, value in fields.items() if value is not None}
        given["t"] = time.time_ns() if published_ns is None else published_ns
        frame = None if self.known is None else self.known.frames.get(topic)
        if frame is None:
            frame = topic.encode() + b"\0"
        return [frame, ENVELOPE_VERSION + pack_map(given), cdr]


def wishes(
    qos: str | None,
    priority: int | None,
    dst: int | None,
    lifespan_ms: float | None,
    type_: str | None,
    published_ns: int | None,
    key: str | None = None,
) -> dict[str, Any]:
    """Header fields of a message. Raises MessageRefusedError for values every daemon refuses."""
    check_wishes(qos, priority, dst, lifespan_ms, published_ns, key)
    return {"q": qos, "p": priority, "d": dst, "ls": lifespan_ms, "ty": type_, "k": key}
