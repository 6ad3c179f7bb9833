"""How old messages are: STAMP records meet the messages they speak of."""

from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple

from sdrlinkd.wire import Stamp

MAX_WAITING = 1024


class Origin(NamedTuple):
    """When a message was submitted, in the receiver's own time, and when its stamp's burst came.

    `asks`: its sender wants a RECEIPT.
    """

    at: float | None
    stamped_at: float
    asks: bool = False


UNKNOWN = Origin(None, 0.0)


class Ages:
    """Origin times, in the receiver's own time, of messages that are not complete yet.

    Age travels, not time: origin = preamble time − age, so no clock needs to be in step.
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
        """The origin of a message that is now complete, or given up; `at` is None when no stamp
        came.
        """
        if not self._origins:
            return UNKNOWN
        return self._origins.pop((src, topic_id, entry_id), UNKNOWN)

    def look(self, src: int, topic_id: int, entry_id: int) -> Origin:
        """The origin of a message that is not complete yet."""
        return self._origins.get((src, topic_id, entry_id), UNKNOWN)

    def expire(self, now: float, is_held: Callable[[int, int, int], bool]) -> None:
        """Forget stamps whose message never became complete, but for those it is still awaited."""
        for _ in range(len(self._origins)):
            key, origin = next(iter(self._origins.items()))
            if now - origin.stamped_at < self._timeout_s:
                return
            if is_held(*key):
                self._origins.move_to_end(key)
            else:
                del self._origins[key]
