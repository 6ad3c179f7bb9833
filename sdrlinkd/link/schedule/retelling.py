"""When records that a whole team should have are told: a few times soon, and then now and then."""

from collections.abc import Iterator
from math import inf

TOLD_AFTER_S = (0.0, 0.3, 1.0)
"""Times in s after which news is told: a lost PDU delays it by less than a renewal."""
PATIENCE_S = (0.02, 0.2, 0.2)
"""For how long each of these waits for spare room, in s."""

RecordKey = tuple[int, ...]


class Retelling:
    """The records that are still to be told, by key, and when."""

    def __init__(self) -> None:
        self._left: dict[RecordKey, tuple[float, int]] = {}
        """When the news came, and how often it was told."""
        self.due_at = inf
        """When the next one is due."""

    def tell(self, key: RecordKey, now: float) -> None:
        """Tell a record that is news at `now`."""
        self._left[key] = now, 0
        self.due_at = min(self.due_at, now)

    def again(self, key: RecordKey, now: float) -> None:
        """Tell a record once more, unless it is being told anyway."""
        last = len(TOLD_AFTER_S) - 1
        self._left.setdefault(key, (now - TOLD_AFTER_S[last], last))
        self.due_at = min(self.due_at, now)

    def take(self, now: float) -> Iterator[tuple[RecordKey, float]]:
        """(key, when it gets a PDU of its own) of those that are due."""
        if now < self.due_at:
            return
        for key, (since, times) in sorted(self._left.items()):
            if since + TOLD_AFTER_S[times] > now:
                continue
            yield key, now + PATIENCE_S[times]
            if times + 1 < len(TOLD_AFTER_S):
                self._left[key] = since, times + 1
            else:
                del self._left[key]
        dues = (since + TOLD_AFTER_S[times] for since, times in self._left.values())
        self.due_at = min(dues, default=inf)

    def clear(self) -> None:
        """Tell nothing any more."""
        self._left.clear()
        self.due_at = inf
