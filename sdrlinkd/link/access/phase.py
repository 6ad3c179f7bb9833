"""The phase of a schedule that a robot follows: it moves slowly, and jumps only if told twice."""

from math import inf

LEAST_S = 5e-5
"""Least change of the phase in s that is always taken at once."""
FORGET_S = 10.0
"""Time in s after which a step that was told once is forgotten."""
DRIFT = 5e-5
"""Largest difference of two crystals' rates, in s per s."""


class Phase:
    """The start of a schedule's frames, as its announcements say it.

    A change of at most half a guard time is taken, though no more than that within a frame. A
    larger one is taken once robots with the same root have told it twice, and not the old phase in
    between.
    """

    def __init__(self, frame_s: float, guard_s: float) -> None:
        self._frame_s = frame_s
        self._most_s = max(guard_s / 2, LEAST_S)
        self._origin: float | None = None
        self._moved_at, self._moved_s = -inf, 0.0
        self._told: dict[int, tuple[float, float]] = {}
        """Steps told once, by root: (start of a frame, when it was told)."""

    def follow(self, root: int, origin: float, at: float) -> float | None:
        """The start of a frame to keep, as `origin` is told for `root` at `at`; None: as before."""
        step_s = inf if self._origin is None else self._off(origin, self._origin)
        if abs(step_s) <= self._most_s:
            self._told.pop(root, None)
            return self._moved(origin, step_s, at)
        told = self._told.get(root)
        if self._origin is None or (
            told is not None
            and told[1] < at <= told[1] + FORGET_S
            and abs(self._off(origin, told[0])) <= self._most_s + DRIFT * (at - told[1])
        ):
            self._told.clear()
            self._origin, self._moved_at, self._moved_s = origin, at, 0.0
            return origin
        self._told[root] = origin, at
        return None

    def keep(self, origin: float) -> None:
        """Keep frames that start at `origin`, as nobody is followed."""
        self._origin = origin
        self._told.clear()

    def _moved(self, origin: float, step_s: float, at: float) -> float | None:
        if at > self._moved_at + self._frame_s:
            self._moved_at, self._moved_s = at, 0.0
        left_s = self._most_s - self._moved_s
        by_s = max(-left_s, min(left_s, step_s))
        self._moved_s += abs(by_s)
        # Counted from the newest frame, so that rounding does not add up.
        self._origin = origin - step_s + by_s
        return self._origin

    def _off(self, origin: float, other: float) -> float:
        """How much later `origin` is, as far as frames tell, in s."""
        return (origin - other + self._frame_s / 2) % self._frame_s - self._frame_s / 2
