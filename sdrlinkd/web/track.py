"""The path of one robot as one side knows it, thinned to what a screen can show."""

from math import hypot

from sdrlinkd.web.positions import PREFERENCE, Position, metres_from

MOST_POINTS = 400
FIRST_STEP_M = 0.02
OLD_S = 3.0
"""Time in s after which a topic that fell silent no longer keeps others from being used."""


class Track:
    """Positions from one topic at a time: the preferred one of those that come."""

    def __init__(self) -> None:
        self._points: list[tuple[float, float]] = []
        self._step_m = FIRST_STEP_M
        self._source: tuple[str, str] | None = None
        self._origin: Position | None = None
        self.last: Position | None = None
        """The last position, in m."""
        self.at = float("-inf")
        """When it came, in s."""

    @property
    def topic(self) -> str:
        """The topic that the path is of; empty before the first position."""
        return "" if self._source is None else self._source[0]

    @property
    def points(self) -> list[tuple[float, float]]:
        """The path in m, with its last point."""
        if self.last is None:
            return []
        return [*self._points, (self.last.x, self.last.y)]

    def add(self, topic: str, kind: str, found: Position, now: float) -> None:
        """Take a position from a topic; one that is preferred less is ignored."""
        source = topic, kind
        if source != self._source:
            known = self._source
            is_less = known is not None and PREFERENCE[kind] >= PREFERENCE[known[1]]
            if is_less and now < self.at + OLD_S:
                return
            # Another topic may have another origin.
            self._source, self._origin, self._points = source, None, []
            self._step_m = FIRST_STEP_M
        if found.is_geographic:
            self._origin = self._origin or found
            found = metres_from(self._origin, found)
        self.last, self.at = found, now
        if self._points:
            x, y = self._points[-1]
            if hypot(found.x - x, found.y - y) < self._step_m:
                return
        self._points.append((found.x, found.y))
        if len(self._points) > MOST_POINTS:
            # A longer path is drawn more coarsely, as a whole.
            self._points = self._points[::2]
            self._step_m *= 2
