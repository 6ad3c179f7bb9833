"""Robots that lately did something a person should know of."""

FORGET_S = 60.0
"""A robot that has not done it for so long is no longer named."""


class Sightings:
    """Which robots did one such thing, how often, and when last (link clock, s)."""

    def __init__(self) -> None:
        self._seen: dict[int, tuple[int, float]] = {}

    def add(self, src: int, at: float) -> None:
        """Note that robot `src` was seen at `at`."""
        n = self._seen[src][0] if self._is_lately(src, at) else 0
        self._seen[src] = n + 1, at

    def clear(self, src: int) -> None:
        """Forget robot `src`: what was seen of it has ended."""
        self._seen.pop(src, None)

    def lately(self, now: float, least: int = 1) -> list[int]:
        """Who did it `least` times or more, without a long pause, in ascending order."""
        return [
            src for src, (n, _) in sorted(self._seen.items())
            if n >= least and self._is_lately(src, now)
        ]  # fmt: skip

    def _is_lately(self, src: int, now: float) -> bool:
        return src in self._seen and now - self._seen[src][1] < FORGET_S
