"""Which entry id the next message of a topic gets (wire document, section 4.2)."""

from collections import deque
from random import Random

# A receiver may hear the last fragment late (reordering, relays), so ids rest a little longer
# than it waits for missing ones.
REST_FACTOR = 1.25


class EntryIds:
    """A shuffled permutation of 0…255 for one topic, in which a used id rests before its return.

    Two fragmented messages under one id within the reassembly timeout could be joined into one
    that nobody sent. A single-entry message leaves nothing behind at the receiver, so its id is
    free again at once.
    """

    def __init__(self, rng: Random, rest_s: float) -> None:
        self._idle = deque(rng.sample(range(256), 256))
        self._resting: deque[tuple[float, int]] = deque()
        self._rest_s = rest_s

    def take(self, now: float) -> int | None:
        """An id that is free at `now`, or None when all are at rest."""
        while self._resting and self._resting[0][0] <= now:
            self._idle.append(self._resting.popleft()[1])
        return self._idle.popleft() if self._idle else None

    def give_back(self, entry_id: int) -> None:
        """The id was used for a message in one entry, or not at all."""
        self._idle.append(entry_id)

    def rest(self, entry_id: int, now: float) -> None:
        """The last fragment under the id went at `now`."""
        self._resting.append((now + self._rest_s, entry_id))

    def hold(self, entry_id: int) -> bool:
        """Its last fragment has not left after all; whether it was at rest. See `rest`."""
        for i, (_, resting) in enumerate(self._resting):
            if resting == entry_id:
                del self._resting[i]
                return True
        return False

    def next_free(self) -> float:
        """When `take` will succeed: −inf at once, +inf never until an id comes back."""
        if self._idle:
            return float("-inf")
        return self._resting[0][0] if self._resting else float("inf")
