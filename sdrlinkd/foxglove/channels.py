"""Channels of the topics that other robots send: their octets as they came, with ROS 2 schemas."""

import logging
import time
from typing import NamedTuple

from foxglove import Channel, Context, Schema

from sdrlinkd.adapters import definition
from sdrlinkd.client import Message

MOST_CHANNELS = 1000
"""Most channels ever made: the SDK forgets none, and names come from the air."""
MOST_KEPT_BYTES = 64 << 20
"""Most octets of last messages, all topics together."""

_log = logging.getLogger(__name__)


class _Kept(NamedTuple):
    payload: bytes
    time_ns: int
    passed_at: float


class ReceivedTopics:
    """A channel for each topic on the bus. Names and types, whatever they are, are text here."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._channels: dict[str, tuple[str, Channel]] = {}
        self._made = 0
        self._kept: dict[str, _Kept] = {}
        """The last message of each topic."""
        self._kept_bytes = 0
        self.passed = 0
        """Messages passed on."""
        self.not_shown = 0
        """Messages of topics for which there is no channel any more."""

    def __len__(self) -> int:
        return len(self._channels)

    def take(self, message: Message) -> None:
        """Pass a message on, at the time of its reception."""
        kind, channel = self._channels.get(message.topic, ("", None))
        if channel is None or kind != message.type:
            channel = self._open(message.topic, message.type, channel)
        if channel is None:
            self.not_shown += 1
            return
        at = time.monotonic()
        channel.log(message.payload, log_time=message.received_ns)
        self.passed += 1
        self._keep(message, at)

    def again(self, topic: str, client: int, since: float) -> None:
        """Give a client that subscribes to a topic the last message, as it missed the first ones.

        A map and static transforms come only once. What was passed on after the client had
        subscribed, at the monotonic time `since`, it has got already.
        """
        kept = self._kept.get(topic)
        if kept is not None and kept.passed_at <= since:
            # In this SDK the id of a client is that of its sink.
            _, channel = self._channels[topic]
            channel.log(kept.payload, log_time=kept.time_ns, sink_id=client)

    def _keep(self, message: Message, at: float) -> None:
        self._forget(message.topic)
        if self._kept_bytes + len(message.payload) <= MOST_KEPT_BYTES:
            self._kept[message.topic] = _Kept(message.payload, message.received_ns, at)
            self._kept_bytes += len(message.payload)

    def _forget(self, topic: str) -> None:
        if old := self._kept.pop(topic, None):
            self._kept_bytes -= len(old.payload)

    def _open(self, topic: str, kind: str, old: Channel | None) -> Channel | None:
        """The channel of a topic that is new, or has got another type."""
        if self._made >= MOST_CHANNELS:
            if not self.not_shown:
                _log.warning("more than %d topics; the others are not shown", MOST_CHANNELS)
            return None
        if old is not None:
            old.close()
            self._forget(topic)
        self._made += 1
        text = definition(kind)
        # A type that nobody here knows has a name and no definition.
        schema = Schema(name=kind, encoding="ros2msg" if text else "", data=text.encode())
        made = Channel(topic, schema=schema, message_encoding="cdr", context=self._context)
        self._channels[topic] = kind, made
        return made
