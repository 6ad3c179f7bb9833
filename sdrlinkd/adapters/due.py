"""Turns a recording into a plan of messages with their due times."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple, Protocol

from sdrlinkd.adapters.bags import BagMessage
from sdrlinkd.adapters.pacing import first_seconds


class Due(NamedTuple):
    """A message to send `at` seconds after the start."""

    at: float
    topic_id: int
    payload: bytes


class Playable(Protocol):
    """A source that can be played: a bag, or the built-in robot."""

    def messages(self) -> Iterator[BagMessage]:
        """All messages in order of time."""


def due_messages(
    recording: Playable, duration_s: float, begin_s: float, topic_ids: Mapping[str, int]
) -> Iterator[Due]:
    """Messages of the first `duration_s`, of topics in `topic_ids`, due from `begin_s` on."""
    first_ns: int | None = None
    for message in first_seconds(recording.messages(), duration_s):
        if first_ns is None:
            first_ns = message.time_ns
        topic_id = topic_ids.get(message.topic)
        if topic_id is not None:
            yield Due(begin_s + (message.time_ns - first_ns) * 1e-9, topic_id, message.cdr)
