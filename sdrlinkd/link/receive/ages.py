"""The ages of messages: matches STAMP records with their messages."""

from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple

from sdrlinkd.wire import Stamp

MAX_WAITING = 64
"""Most messages of one source whose age is known before they are complete."""


class Origin(NamedTuple):
    """Origin of a message: when it was submitted (`at`), and when its STAMP came (`stamped_at`).

    Both are on the receiver's clock. `asks`: the sender wants a RECEIPT.
    """

    at: float | None
    stamped_at: float
    asks: bool = False


UNKNOWN = Origin(None, 0.0)


class Ages:
    """Origins, on the receiver's clock, of messages that are not complete yet.

    A STAMP carries an age instead of a time: origin = preamble time − age. So the robots' clocks
    need not be synchronized.
    """

    def __init__(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._by_src: dict[int, OrderedDict[tuple[int, int], Origin]] = {}

    def stamp(self, src: int, stamp: Stamp, at: float) -> None:
        """Note a STAMP record that came in a burst whose preamble was at `at`."""
        topic_id, entry_id, age_us, asks = stamp
        origins = self._by_src.get(src)
        if origins is None:
            origins = self._by_src[src] = OrderedDict()
        key = (topic_id, entry_id)
        origins[key] = Origin(at - age_us * 1e-6, at, asks)
        origins.move_to_end(key)
        if len(origins) > MAX_WAITING:
            origins.popitem(last=False)

    def take(self, src: int, topic_id: int, entry_id: int) -> Origin:
        """Take out the origin of a message that is complete or given up.

        Its `at` is None if no STAMP came.
        """
        origins = self._by_src.get(src)
        if not origins:
            return UNKNOWN
        return origins.pop((topic_id, entry_id), UNKNOWN)

    def look(self, src: int, topic_id: int, entry_id: int) -> Origin:
        """The origin of a message that is not complete yet."""
        origins = self._by_src.get(src)
        return UNKNOWN if origins is None else origins.get((topic_id, entry_id), UNKNOWN)

    def __len__(self) -> int:
        """Number of messages whose age is known before they are complete."""
        return sum(map(len, self._by_src.values()))

    def expire(self, now: float, is_held: Callable[[int, int, int], bool]) -> None:
        """Forget old stamps, except those of messages that are still incomplete (`is_held`)."""
        for src, origins in self._by_src.items():
            for _ in range(len(origins)):
                key, origin = next(iter(origins.items()))
                if now - origin.stamped_at < self._timeout_s:
                    break
                if is_held(src, *key):
                    origins.move_to_end(key)
                else:
                    del origins[key]
