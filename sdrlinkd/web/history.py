"""What a station reported over the last minutes, once a second."""

from collections import deque
from collections.abc import Mapping

from sdrlinkd.over_time import FIGURES, figures_of, is_later
from sdrlinkd.reports import Snapshot

KEPT_S = 600
RECENT_S = 61
MOST_LINES = 40
"""Most lines in one picture; the robots and names that come first."""


class History:
    """Lines over time: `lines[picture][name]` has a value for each time in `times`, or None."""

    def __init__(self) -> None:
        self.times: deque[float] = deque(maxlen=KEPT_S)
        """Seconds since 1970."""
        self.lines: dict[str, dict[str, deque[float | None]]] = {name: {} for name in FIGURES}
        self.recent: deque[Snapshot] = deque(maxlen=RECENT_S)
        """The reports of the last minute."""
        self._before: Snapshot | None = None

    def add(self, snapshot: Snapshot | None, at: float) -> None:
        """Add a second; None where there is no report."""
        self.times.append(at)
        for picture, values in figures_of(snapshot, self._since(snapshot)).items():
            self._append(self.lines[picture], values)
        self._before = snapshot
        if snapshot is not None:
            self.recent.append(snapshot)

    def _since(self, snapshot: Snapshot | None) -> Snapshot | None:
        """The report before, unless the daemon started anew."""
        before = self._before
        if snapshot is None or before is None or not is_later(snapshot, before):
            return None
        return before

    def _append(
        self, lines: dict[str, deque[float | None]], values: Mapping[str, float | None]
    ) -> None:
        for name in values:
            if name not in lines and len(lines) < MOST_LINES:
                empty = [None] * (len(self.times) - 1)
                lines[name] = deque(empty, maxlen=KEPT_S)
        for name, line in lines.items():
            line.append(values.get(name))
        for name in [name for name, line in lines.items() if not any(v is not None for v in line)]:
            del lines[name]
