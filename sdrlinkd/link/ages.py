"""How old messages are: STAMP records meet the messages they speak of."""

from collections import OrderedDict

MAX_WAITING = 1024


class Ages:
    """Origin times, in the receiver's own time, of messages that are not complete yet.

    Age travels, not time: origin = preamble time − age, so no clock needs to be in step.
    """

    def __init__(self, timeout_s: float) -> None:
        self._timeout_s = timeout_s
        self._origins: OrderedDict[tuple[int, int, int], tuple[float, float]] = OrderedDict()

    def stamp(self, src: int, topic_id: int, entry_id: int, age_us: int, at: float) -> None:
        """A STAMP record arrived in a burst whose preamble was at `at`."""
        key = (src, topic_id, entry_id)
        self._origins[key] = (at - age_us * 1e-6, at)
        self._origins.move_to_end(key)
        if len(self._origins) > MAX_WAITING:
            self._origins.popitem(last=False)

    def origin(self, src: int, topic_id: int, entry_id: int) -> float | None:
        """When the message that is now complete was submitted; None when no stamp came."""
        if not self._origins:
            return None
        found = self._origins.pop((src, topic_id, entry_id), None)
        return None if found is None else found[0]

    def expire(self, now: float) -> None:
        """Forget stamps whose message never became complete."""
        while self._origins:
            key, (_, at) = next(iter(self._origins.items()))
            if now - at < self._timeout_s:
                return
            del self._origins[key]
