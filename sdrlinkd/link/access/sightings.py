"""Robots that did something a person should know of, for as long as they do it."""

FORGET_S = 60.0
"""Robots that stopped doing it, or left, are not told of for longer."""


class Sightings:
    """Who was seen, how often, and when last (link clock, s)."""

    def __init__(self) -> None:
        self._seen: dict[int, tuple[int, float]] = {}

    def add(self, src: int, at: float) -> None:
        """It did so once more."""
        n = self._seen[src][0] if self._is_lately(src, at) else 0
        self._seen[src] = n + 1, at

    def clear(self, src: int) -> None:
        """It mended its ways."""
        self._seen.pop(src, None)

    def lately(self, now: float, least: int = 1) -> list[int]:
        """Who did it `least` times or more, without a long pause, in ascending order."""
        return [
            src for src, (n, _) in sorted(self._seen.items())
            if n >= least and self._is_lately(src, now)
        ]  # fmt: skip

    def _is_lately(self, src: int, now: float) -> bool:
        return src in self._seen and now - self._seen[src][1] < FORGET_S
