"""Summarizes a recording: its duration, and the rates and sizes of its messages."""

from collections.abc import Callable
from typing import NamedTuple

from sdrlinkd.adapters.bags import Bag


class TopicSummary(NamedTuple):
    """A topic of a recording; sizes are bytes of CDR, `rate_hz` is None without a time span."""

    name: str
    type: str
    n_messages: int
    rate_hz: float | None
    mean_bytes: float
    max_bytes: int


class BagSummary(NamedTuple):
    """A whole recording, with its topics in order of their names."""

    duration_s: float
    n_messages: int
    n_bytes: int
    topics: list[TopicSummary]
    pause_s: float
    """The longest time without a message."""


class _Seen:
    """Number, sizes and times of a topic's messages read so far."""

    def __init__(self) -> None:
        self.n = self.n_bytes = self.max_bytes = self.first_ns = self.last_ns = self.pause_ns = 0

    def add(self, time_ns: int, size: int) -> None:
        if not self.n:
            self.first_ns = self.last_ns = time_ns
        self.pause_ns = max(self.pause_ns, time_ns - self.last_ns)
        self.n, self.last_ns = self.n + 1, time_ns
        self.n_bytes, self.max_bytes = self.n_bytes + size, max(self.max_bytes, size)

    @property
    def rate_hz(self) -> float | None:
        span_ns = self.last_ns - self.first_ns
        return 1e9 * (self.n - 1) / span_ns if span_ns > 0 else None


def summarise(bag: Bag, progress: Callable[[int], None]) -> BagSummary:
    """The summary of `bag`, which is read completely; calls `progress(messages read)` meanwhile."""
    seen = {(topic.name, topic.type): _Seen() for topic in bag.topics()}
    whole = _Seen()
    for message in bag.messages():
        size = len(message.cdr)
        seen.setdefault((message.topic, message.type), _Seen()).add(message.time_ns, size)
        whole.add(message.time_ns, size)
        progress(whole.n)
    return BagSummary(
        duration_s=1e-9 * (whole.last_ns - whole.first_ns),
        n_messages=whole.n,
        n_bytes=whole.n_bytes,
        pause_s=1e-9 * whole.pause_ns,
        topics=[
            TopicSummary(*key, each.n, each.rate_hz, each.n_bytes / max(1, each.n), each.max_bytes)
            for key, each in sorted(seen.items())
        ],
    )
