"""Robots that recently did something that a person should know about."""

FORGET_S = 60.0
"""Time in s after which a robot is no longer listed."""


class Sightings:
    """Which robots did a certain thing, how often, and when last (link's clock, in s)."""

    def __init__(self) -> None:
        self._seen: dict[int, tuple[int, float]] = {}

    def add(self, src: int, at: float) -> None:
        """Note that robot `src` was seen at `at`."""
        n = self._seen[src][0] if self._is_lately(src, at) else 0
        self._seen[src] = n + 1, at

    def clear(self, src: int) -> None:
        """Forget robot `src`, which has stopped doing it."""
        self._seen.pop(src, None)

    def lately(self, now: float, least: int = 1) -> list[int]:
        """Robots seen recently, at least `least` times without a long pause, in ascending order."""
        return [
            src for src, (n, _) in sorted(self._seen.items())
            if n >= least and self._is_lately(src, now)
        ]  # fmt: skip

    def _is_lately(self, src: int, now: float) -> bool:
        return src in self._seen and now - self._seen[src][1] < FORGET_S


def schedule_notices(
    outsiders: Sightings, strangers: Sightings, state: str, now: float
) -> list[str]:
    """Sentences on robots with a schedule that are not listed, or whose schedule is not ours."""
    outside = [
        f"robot {src} announces a schedule and is ignored: it or the schedule's root is not in "
        "access.nodes; list all robots there, at every robot, or look who sends it"
        for src in outsiders.lately(now)
    ]
    differing = [
        f"robot {src} keeps a different schedule; give both the same [access], and radios of one "
        f"kind (ours: {state})"
        for src in strangers.lately(now)
    ]
    return outside + differing
