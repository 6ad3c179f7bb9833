"""The ages of messages: matches STAMP records with their messages."""

from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple

from sdrlinkd.wire import Stamp

MAX_WAITING = 1024


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
        self._origins: OrderedDict[tuple[int, int, int], Origin] = OrderedDict()

    def stamp(self, src: int, stamp: Stamp, at: float) -> None:
        """Note a STAMP record that came in a burst whose preamble was at `at`."""
        topic_id, entry_id, age_us, asks = stamp
        key = (src, topic_id, entry_id)
        self._origins[key] = Origin(at - age_us * 1e-6, at, asks)
        self._origins.move_to_end(key)
        if len(self._origins) > MAX_WAITING:
            self._origins.popitem(last=False)

    def take(self, src: int, topic_id: int, entry_id: int) -> Origin:
        """Take out the origin of a message that is complete or given up.

        Its `at` is None if no STAMP came.
        """
        if not self._origins:
            return UNKNOWN
        return self._origins.pop((src, topic_id, entry_id), UNKNOWN)

    def look(self, src: int, topic_id: int, entry_id: int) -> Origin:
        """The origin of a message that is not complete yet."""
        return self._origins.get((src, topic_id, entry_id), UNKNOWN)

    def expire(self, now: float, is_held: Callable[[int, int, int], bool]) -> None:
        """Forget old stamps, except those of messages that are still incomplete (`is_held`)."""
        for _ in range(len(self._origins)):
            key, origin = next(iter(self._origins.items()))
            if now - origin.stamped_at < self._timeout_s:
                return
            if is_held(*key):
                self._origins.move_to_end(key)
            else:
                del self._origins[key]
