"""Messages of `transient_local` topics, kept for consumers that subscribe later."""

from collections import OrderedDict, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

import msgspec

from sdrlinkd.bus.envelope import OutHeader

MOST_BYTES = 64 << 20
"""Most bytes kept; beyond that, the series that was silent for longest loses its oldest message."""
OVERHEAD = 512
"""Bytes counted for a message besides its payload."""


class Retained(NamedTuple):
    """A message from the air as it was published at `at`, with its topic frame.

    `at` is in s on a clock that is never set. The message is too old to be given to anybody once
    its age exceeds `lifespan_s`.
    """

    frame: bytes
    header: OutHeader
    payload: bytes
    lifespan_s: float = inf
    at: float = 0.0

    def late(self, now: float) -> OutHeader | None:
        """The header for consumers that subscribe at `now`; None: the message is too old."""
        age_us = (self.header.age or 0) + round(1e6 * (now - self.at))
        if age_us > 1e6 * self.lifespan_s:
            return None
        told = age_us if self.header.age is not None else None
        return msgspec.structs.replace(self.header, late=True, age=told)


@dataclass(slots=True)
class _Series:
    messages: deque[tuple[int, Retained]] = field(default_factory=deque)
    n_bytes: int = 0


class Retention:
    """The last messages of each series, which is one topic and producer of one source."""

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._series: OrderedDict[tuple[int, int], _Series] = OrderedDict()
        self._n_bytes = self._count = 0

    def keep(self, key: tuple[int, int], message: Retained, depth: int) -> None:
        """Keep the newest message of series `key`, and of that series the last `depth`."""
        series = self._series.setdefault(key, _Series())
        self._series.move_to_end(key)
        self._count += 1
        series.messages.append((self._count, message))
        self._note_size(series, message, 1)
        while len(series.messages) > depth:
            self._drop_oldest(series)
        while self._n_bytes > self._most_bytes:
            silent, oldest = next(iter(self._series.items()))
            if oldest is series and len(series.messages) == 1:
                return
            self._drop_oldest(oldest)
            if not oldest.messages:
                self.forget(silent)

    def forget(self, key: tuple[int, int]) -> None:
        """Keep no message of series `key` any more."""
        if (series := self._series.pop(key, None)) is not None:
            self._n_bytes -= series.n_bytes

    def forget_topic(self, topic_id: int) -> None:
        """Keep no message of a topic any more, from whatever source."""
        for key in [key for key in self._series if key[1] == topic_id]:
            self.forget(key)

    def matching(self, prefix: bytes) -> Iterator[Retained]:
        """The kept messages whose topic frames begin with `prefix`, in order of reception."""
        found = [
            numbered
            for series in self._series.values()
            for numbered in series.messages
            if numbered[1].frame.startswith(prefix)
        ]
        return (message for _, message in sorted(found, key=lambda numbered: numbered[0]))

    def _drop_oldest(self, series: _Series) -> None:
        _, message = series.messages.popleft()
        self._note_size(series, message, -1)

    def _note_size(self, series: _Series, message: Retained, sign: int) -> None:
        n_bytes = sign * (len(message.payload) + OVERHEAD)
        series.n_bytes += n_bytes
        self._n_bytes += n_bytes
