"""Detects command topics that fall silent, whose consumers then need a stop message."""


class Deadman:
    """Dead-man timers of topics: a message arms the timer, which expires once if none follows."""

    def __init__(self) -> None:
        self._due_at: dict[tuple[int, int], float] = {}
        self.stops: dict[tuple[int, int], int] = {}
        """How often a topic fell silent, by (source, topic id)."""

    @property
    def next_at(self) -> float:
        """Time at which the first timer expires; infinity if none is armed."""
        return min(self._due_at.values(), default=float("inf"))

    def fresh(self, src: int, topic_id: int, now: float, deadman_s: float) -> None:
        """Note a message of a topic that must not fall silent for `deadman_s`."""
        self._due_at[src, topic_id] = now + deadman_s

    def disarm(self, src: int, topic_id: int) -> None:
        """Expect no more messages of a topic from robot `src`."""
        self._due_at.pop((src, topic_id), None)

    def forget(self, topic_id: int) -> None:
        """Disarm a topic's timers."""
        for key in [key for key in self._due_at if key[1] == topic_id]:
            del self._due_at[key]

    def take_due(self, now: float) -> list[tuple[int, int]]:
        """(source, topic id) of topics that fell silent, each once."""
        due = [key for key, at in self._due_at.items() if at <= now]
        for key in due:
            del self._due_at[key]
            self.stops[key] = self.stops.get(key, 0) + 1
        return due
