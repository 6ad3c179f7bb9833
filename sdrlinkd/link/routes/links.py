"""The links of the team: how well we hear others, and what the LSAs of all say."""

from collections.abc import Callable, Iterator
from math import inf

from sdrlinkd.link.paths import Edges
from sdrlinkd.link.routes.qualities import Qualities
from sdrlinkd.link.routes.table import LsaTable
from sdrlinkd.reports import RobotLinksReport
from sdrlinkd.wire import BROADCAST, HEARD_SIZE, LSA_OVERHEAD, Lsa, share_of

SYNC_S = 1.0
"""Least time in s until all LSAs are told again."""
NEWS_S, SYNC_PATIENCE_S = 0.02, 0.2
"""Time in s for which an LSA waits for spare room: if it is new, and if it is told again."""
AGAIN_S, RECENT_S = 0.3, 3.0
"""Least time in s between two times that our own LSA is told, and the age in s up to which a digest
that differs brings it again so soon."""


class Links:
    """Measures our links, floods LSAs, and knows which robots hear each other.

    `room` is the number of record octets in a PDU. `draw` gives the first number of our LSAs.
    """

    def __init__(self, own_id: int, room: int, draw: Callable[[], int]) -> None:
        self._own_id = own_id
        self._most = max(0, room - LSA_OVERHEAD) // HEARD_SIZE
        self.qualities = Qualities()
        self._table = LsaTable(own_id, draw())
        self.news: dict[int, float] = {}
        """The LSAs to be told, by robot, and when each gets a PDU of its own."""
        self._synced_at = self._own_told_at = -inf

    @property
    def edges(self) -> Edges:
        """The links that both ends hear."""
        return self._table.edges

    @property
    def version(self) -> int:
        """Counts the changes of `edges`."""
        return self._table.version

    def number_from(self, first: int) -> None:
        """Give our next LSA the number after `first`."""
        self._table.number_from(first)

    def take(self, teller: int, lsa: Lsa, at: float) -> None:
        """Take an LSA record that robot `teller` told directly."""
        if lsa.node == BROADCAST:
            if lsa.number != self._table.digest().number:
                self.tell_all(at)
                self._tell_own_again(at)
        elif self._table.take(lsa, teller, at) and not self._all_hear(teller):
            self.news[lsa.node] = at + NEWS_S

    def newcomer(self, src: int, at: float) -> None:
        """Begin anew with a robot that was heard for the first time, or has restarted."""
        self.qualities.forget(src)
        self._table.restarted(src)
        self.tell_all(at)

    def tell_all(self, now: float) -> None:
        """Tell the LSAs of all robots that are reached, unless that was done a moment ago."""
        if now - self._synced_at > SYNC_S:
            self._synced_at = now
            for node in self._table.reached:
                self.news.setdefault(node, now + SYNC_PATIENCE_S)

    def look(self, now: float) -> None:
        """Make a new LSA if we hear others than before; forget robots that are gone."""
        if self._table.renew(self.qualities.losses(now), self._most, now) is not None:
            self.news[self._own_id] = now + NEWS_S
            self._own_told_at = now
        self._table.expire(now)

    def take_news(self) -> Iterator[tuple[Lsa, float]]:
        """(LSA, when it gets a PDU of its own) of those to be told, each once."""
        for node, alone_at in sorted(self.news.items()):
            lsa = self._table.lsa(node)
            if lsa is not None:
                yield _short(lsa, self._most), alone_at
        self.news.clear()

    def digest(self) -> Lsa:
        """The record that stands for the LSAs of all robots that are reached."""
        return self._table.digest()

    def begin_anew(self) -> None:
        """Go on with another clock; nothing that was heard before counts."""
        self.qualities.begin_anew()
        self._table.begin_anew()
        self.news.clear()
        self._synced_at = self._own_told_at = -inf

    def report(self, now: float) -> list[RobotLinksReport]:
        """Whom each robot hears, and how well."""
        return [
            RobotLinksReport(
                id=lsa.node,
                told_s_ago=max(0.0, now - at),
                hears={other: share_of(loss) for other, loss in lsa.losses},
            )
            for lsa, at in self._table.held()
        ]

    def _tell_own_again(self, at: float) -> None:
        """Tell our own LSA again if it is new: whoever has missed it may take us for deaf."""
        if at > self._own_told_at + AGAIN_S and at < self._table.renewed_at + RECENT_S:
            self._own_told_at = at
            self.news.setdefault(self._own_id, at + SYNC_PATIENCE_S)

    def _all_hear(self, teller: int) -> bool:
        """Whether all robots that we hear are known to hear the one that told something."""
        table, own = self._table, self._own_id
        others = set(table.heard_by(own)) - {teller}
        return own in table and all(teller in table.heard_by(node) for node in others)


def _short(lsa: Lsa, most: int) -> Lsa:
    """An LSA with at most so many robots: those with the least loss."""
    if len(lsa.losses) <= most:
        return lsa
    best = sorted(lsa.losses, key=lambda each: each[1])[:most]
    return lsa._replace(losses=tuple(sorted(best)))
