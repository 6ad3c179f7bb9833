"""The routes of a robot as one object: what it relays, whom it names, and what it answers."""

from collections.abc import Callable
from typing import NamedTuple

from sdrlinkd.link.paths import Edges
from sdrlinkd.link.routes.fixed import FixedRoutes
from sdrlinkd.link.routes.flow import ANSWER_S
from sdrlinkd.link.routes.forwarding import Again, Forwarding
from sdrlinkd.link.routes.links import Links
from sdrlinkd.link.routes.named import LEAST_HOPS, Named
from sdrlinkd.link.routes.params import RelayParams
from sdrlinkd.link.routes.to_relay import PduToRelay
from sdrlinkd.reports import RoutesReport
from sdrlinkd.wire import DST, HOP, PDU_NUMBERS, SEQ, SRC, Lsa, Need, Pdu, RecordType, Route

NO_BITS = b"\0"
ANSWER = -1
"""In the place of a PDU number: a NEED that asks for nothing."""


class Told(NamedTuple):
    """A record to be sent in spare room, and from `alone_at` on in a PDU of its own.

    `key` distinguishes it from others that wait: its type, and what it is about.
    """

    record: Lsa | Route | Need
    key: tuple[int, ...]
    alone_at: float


class Routes:
    """Decides what is relayed, and finds the paths for that where `relay.policy` is "auto".

    `room` is the number of record octets in a PDU. `draw` gives the first number of our LSAs.
    """

    def __init__(
        self, params: RelayParams, own_id: int, hop_limit: int, room: int, draw: Callable[[], int]
    ) -> None:
        self._own_id = own_id
        self._hop_limit = hop_limit
        self._fixed = FixedRoutes(params)
        self.is_auto = params.policy == "auto"
        """Whether routes are found."""
        self.is_on = self.is_auto or self._fixed.is_on
        """Whether this robot relays any PDUs."""
        self.lifespan_s = params.lifespan_s
        """Longest wait in s of a PDU to be relayed."""
        self._draw = draw
        self._links = Links(own_id, room, draw if self.is_auto else lambda: 0)
        self.tells_links = self.is_auto
        """Whether this robot tells whom it hears."""
        self._named = Named(own_id)
        self._forwarding = Forwarding(own_id, self._links, self._named)
        self._taken_version = 0
        self._owed: dict[int, float] = {}
        """Since when answers are owed, by source."""
        self._newest: dict[int, int] = {}
        """The highest PDU number that was heard of each source."""

    def tell_links(self) -> None:
        """Tell whom we hear, whatever is relayed."""
        if not self.tells_links:
            self.tells_links = True
            self._links.number_from(self._draw())

    def set_needed_snr(self, needed_db: float) -> None:
        """Set the SNR in dB that the most robust MCS in use needs."""
        self._links.qualities.set_needed_snr(needed_db)

    # What comes.

    def wants(self, pdu: Pdu, now: float, *, is_far: bool) -> bool:
        """Whether a PDU is to be relayed; it never goes back to its source.

        `is_far`: it holds something for robots that hear relays only.
        """
        if not self._may(pdu):
            return False
        if not self.is_auto:
            return self._fixed.wants(pdu.src, pdu.dst)
        return is_far and self._named.is_named((pdu.src, pdu.dst), now)

    def may_want(self, pdu: Pdu, *, is_far: bool) -> bool:
        """Whether another robot may yet name this one for a PDU."""
        return self.is_auto and is_far and self._may(pdu)

    def keep(self, spare: PduToRelay) -> None:
        """Keep a PDU that this robot was not named for."""
        self._named.keep(spare)

    def placed(
        self, src: int, dst: int, number: int, at: float, snr_db: float | None, *,
        is_direct: bool, has_messages: bool,
    ) -> None:  # fmt: skip
        """Note a PDU that was not heard before; `is_direct`: neither relayed nor repeated."""
        if not self.tells_links or src == self._own_id:
            return
        self._links.qualities.placed(src, number, at, snr_db, is_direct=is_direct)
        if not self.is_auto:
            return
        self._newest[src] = max(number, self._newest.get(src, number))
        if has_messages and (dst == self._own_id or self._named.is_named((src, dst), at)):
            self._owed.setdefault(src, at)

    def forwarded(self, raw: bytes, at: float) -> None:
        """Note an intact PDU, which another robot than its source may have sent."""
        hops_left = raw[HOP] >> 4
        if self.is_auto and hops_left < self._hop_limit:
            src, dst, seq = raw[SRC], raw[DST], raw[SEQ]
            self._named.forwarded((src, dst), seq, hops_left)
            self._forwarding.forwarded(src, dst, seq, hops_left, at)
            is_named = src in self._newest and self._named.is_named((src, dst), at)
            if is_named and self._forwarding.comes_late(src, dst, hops_left):
                self._owed.setdefault(src, at)

    def hear(self, src: int, record: Lsa | Route | Need, at: float) -> list[PduToRelay]:
        """Take a record that robot `src` told directly; returns PDUs that came before, and are to
        be forwarded after all.
        """
        if isinstance(record, Lsa):
            if self.tells_links:
                self._links.take(src, record, at)
        elif not self.is_auto:
            return []
        elif isinstance(record, Need):
            self._forwarding.answered(src, record, at)
            return self._named.needed(record, at)
        else:
            return self._named.take(record, src, at)
        return []

    def newcomer(self, src: int, at: float) -> None:
        """Begin anew with a robot that was heard for the first time, or has restarted."""
        if self.tells_links:
            self._newest.pop(src, None)
            self._owed.pop(src, None)
            self._links.newcomer(src, at)

    # What goes.

    def sent(self, raw: bytes, number: int, at: float, *, is_bare: bool = False) -> None:
        """Note that a PDU has left at `at`, ours or one that we relay; again, if it was repeated.

        `is_bare`: it holds only control records.
        """
        if not self.is_auto:
            return
        src, dst = raw[SRC], raw[DST]
        self._forwarding.sent(src, dst, number, raw[HOP] >> 4, at, is_bare=is_bare)
        if not is_bare and src != self._own_id and self._named.is_alone((src, dst)):
            self._owed.pop(src, None)

    def look(self, now: float) -> list[Again]:
        """Do what is due at `now`; returns the PDUs that are sent again, as nobody answered."""
        if self.tells_links:
            self._links.look(now)
        if not self.is_auto:
            return []
        self._named.expire(now)
        return self._forwarding.look(now)

    @property
    def has_new_links(self) -> bool:
        """Whether the links of the team have changed since they were taken last."""
        return self._taken_version != self._links.version

    def take_links(self) -> Edges:
        """The links of the team."""
        self._taken_version = self._links.version
        return self._links.edges

    @property
    def edges(self) -> Edges:
        """The links of the team."""
        return self._links.edges

    @property
    def has_news(self) -> bool:
        """Whether `told` would return records."""
        return bool(self._links.news or self._owed) or self._forwarding.has_news

    def told(self, now: float) -> list[Told]:
        """The records to be sent, each once."""
        found = [
            Told(lsa, (RecordType.LSA, lsa.node), alone_at)
            for lsa, alone_at in self._links.take_news()
        ]
        found += [
            Told(route, (RecordType.ROUTE, route.src, route.dst), alone_at)
            for route, alone_at in self._forwarding.take_news(now)
        ]
        for src, since in self._owed.items():
            number = (self._newest[src] + 1) % PDU_NUMBERS
            key = (RecordType.NEED, src, ANSWER)
            found.append(Told(Need(src, number, NO_BITS), key, since + ANSWER_S))
        self._owed.clear()
        return found

    def digest(self) -> Lsa | None:
        """The record that stands for the LSAs of the team, to be sent beside a BEACON."""
        return self._links.digest() if self.tells_links else None

    def begin_anew(self) -> None:
        """Go on with another clock; nothing that was heard before counts."""
        self._links.begin_anew()
        self._named.begin_anew()
        self._forwarding.begin_anew()
        self._owed.clear()
        self._newest.clear()

    def report(self, now: float) -> RoutesReport:
        """The links of the team, and who forwards what."""
        return RoutesReport(
            robots=self._links.report(now) if self.tells_links else [],
            flows=self._forwarding.report(now) if self.is_auto else [],
            going_around=sorted(self._forwarding.around),
        )

    def _may(self, pdu: Pdu) -> bool:
        src, dst = pdu.src, pdu.dst
        return pdu.hop >= LEAST_HOPS and self._own_id not in (src, dst) and src != dst
