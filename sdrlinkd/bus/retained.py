"""Messages of `transient_local` topics, kept for consumers that subscribe later."""

from collections import OrderedDict, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

import msgspec

from sdrlinkd.bus.envelope import OutHeader

MOST_BYTES = 64 << 20
"""Most payload bytes kept; beyond that, the series that was silent for longest loses its oldest."""


class Retained(NamedTuple):
    """A message from the air as it was published, with its topic frame.

    It is too old to be given to anybody once its age exceeds `lifespan_s`.
    """

    frame: bytes
    header: OutHeader
    payload: bytes
    lifespan_s: float = inf

    def late(self, now_ns: int) -> OutHeader | None:
        """The header for consumers that subscribe at `now_ns`; None: the message is too old."""
        later_us = max(0, now_ns - self.header.tr) // 1000
        age_us = (self.header.age or 0) + later_us
        if age_us > 1e6 * self.lifespan_s:
            return None
        told = age_us if self.header.age is not None else None
        return msgspec.structs.replace(self.header, late=True, age=told)


@dataclass(slots=True)
class _Series:
    messages: deque[Retained] = field(default_factory=deque)
    n_bytes: int = 0


class Retention:
    """The last messages of each series, which is one topic of one source."""

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._series: OrderedDict[tuple[int, int], _Series] = OrderedDict()
        self._n_bytes = 0

    def keep(self, key: tuple[int, int], message: Retained, depth: int) -> None:
        """Keep the newest message of series `key`, and of that series the last `depth`."""
        series = self._series.setdefault(key, _Series())
        self._series.move_to_end(key)
        series.messages.append(message)
        self._count(series, len(message.payload))
        while len(series.messages) > depth:
            self._count(series, -len(series.messages.popleft().payload))
        while self._n_bytes > self._most_bytes:
            silent, oldest = next(iter(self._series.items()))
            self._count(oldest, -len(oldest.messages.popleft().payload))
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
            message
            for series in self._series.values()
            for message in series.messages
            if message.frame.startswith(prefix)
        ]
        return iter(sorted(found, key=lambda message: (message.header.tr, message.header.n)))

    def _count(self, series: _Series, n_bytes: int) -> None:
        series.n_bytes += n_bytes
        self._n_bytes += n_bytes
