"""Command topics that fall silent: who obeys them must be told to stop."""


class Deadman:
    """Armed by a fresh message, due once when no other follows in time."""

    def __init__(self) -> None:
        self._due_at: dict[tuple[int, int], float] = {}
        self.stops: dict[tuple[int, int], int] = {}
        """Times that it came to that, by (source, topic id)."""

    @property
    def next_at(self) -> float:
        """When the first one is due, if nothing comes before."""
        return min(self._due_at.values(), default=float("inf"))

    def fresh(self, src: int, topic_id: int, now: float, deadman_s: float) -> None:
        """Note a message of a topic that must not fall silent for `deadman_s`."""
        self._due_at[src, topic_id] = now + deadman_s

    def forget(self, topic_id: int) -> None:
        """Let a topic be silent from now on."""
        for key in [key for key in self._due_at if key[1] == topic_id]:
            del self._due_at[key]

    def take_due(self, now: float) -> list[tuple[int, int]]:
        """(source, topic id) of those that fell silent, each once."""
        due = [key for key, at in self._due_at.items() if at <= now]
        for key in due:
            del self._due_at[key]
            self.stops[key] = self.stops.get(key, 0) + 1
        return due
