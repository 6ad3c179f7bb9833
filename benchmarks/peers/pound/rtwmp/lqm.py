"""The link quality matrix: who hears whom how well, as one node knows it."""

from collections.abc import Sequence

SMOOTHING = 1 / 50
"""Weight of the newest frame. The program averages the last 50."""
FLOOR = 12.0
"""Assumed by who hears a node that does not report to hear it."""


class Lqm:
    """Row i, column j: how well node i hears node j, from 0 (not) to 100.

    Row `me` is measured here; the other rows come in tokens.
    """

    def __init__(self, me: int, n_nodes: int) -> None:
        self.me = me
        self.rows: list[tuple[float, ...]] = [(0.0,) * n_nodes for _ in range(n_nodes)]
        self._mine = [0.0] * n_nodes
        self._heard_at = [0.0] * n_nodes
        self._ids = set(range(n_nodes))

    def fill(self, rows: Sequence[Sequence[float]]) -> None:
        """Take a whole matrix, as if it had been measured: the paper's *fake LQM*."""
        self.rows = [tuple(row) for row in rows]
        self._mine = list(rows[self.me])

    def hear(self, node: int, quality: float, now: float) -> None:
        """Note a frame from a neighbor."""
        old = self._mine[node]
        self._mine[node] = old + SMOOTHING * (quality - old) if old else quality
        self._heard_at[node] = now

    def take(self, rows: Sequence[tuple[float, ...]], sender: int) -> None:
        """Take the rows of the other nodes from a token."""
        self.rows = list(rows)
        if not rows[sender][self.me]:
            # It cannot know yet: it may never have heard me.
            row = list(rows[sender])
            row[self.me] = FLOOR
            self.rows[sender] = tuple(row)

    def fail(self, node: int) -> None:
        """Note that a neighbor does not answer."""
        self._mine[node] = 0.0

    def age(self, now: float, hold_s: float) -> None:
        """Forget neighbors that were last heard longer than `hold_s` ago."""
        for node, at in enumerate(self._heard_at):
            if now - at > hold_s:
                self._mine[node] = 0.0

    def matrix(self) -> tuple[tuple[float, ...], ...]:
        """All rows, with mine as it is now."""
        self.rows[self.me] = tuple(self._mine)
        return tuple(self.rows)

    def link(self, a: int, b: int) -> float:
        """Quality of the link between two nodes: that of its worse direction."""
        return min(self._row(a)[b], self._row(b)[a])

    def reachable(self) -> set[int]:
        """The nodes to which there is a path from here, over any number of hops."""
        found = {self.me}
        fresh = [self.me]
        while fresh:
            at = fresh.pop()
            more = [node for node in self._ids - found if self.link(at, node)]
            found.update(more)
            fresh += more
        return found - {self.me}

    def _row(self, node: int) -> Sequence[float]:
        return self._mine if node == self.me else self.rows[node]
