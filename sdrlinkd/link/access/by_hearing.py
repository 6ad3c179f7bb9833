"""`auction` where all robots hear each other, and `grant` while they do not.

The auction needs to be heard by all. Whoever learns that two robots that are here do not hear each
other begins to plan turns by request (`grant`), in a burst that it has won in the auction. The best
root does so first. Whoever hears a plan follows it. Once all robots have heard each other for some
time, the root tells its last plan, and the auction goes on after it.
"""

from math import inf

from sdrlinkd.link.access.auction import Auction
from sdrlinkd.link.access.base import BusyChannel, Slot, Wish
from sdrlinkd.link.access.grant import Grants
from sdrlinkd.link.access.hearing import Hearing, Pair
from sdrlinkd.link.paths import Edges
from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import Frame, Grant, Want

BACK_S, MOST_BACK_S = 3.0, 60.0
"""Time in s for which all robots must have heard each other before the auction goes on. It doubles
if that did not last for FLAP_S, up to the second one."""
FLAP_S = 10.0
PLACE_S = 0.3
"""How long in s a robot waits for the plan of each one that would be a better root."""
LOOK_S = 0.05
"""How often, in s, a robot looks at who hears whom."""


class ByHearing(BusyChannel):
    """The access policy `auction` with its fall-back to `grant`.

    Both know who is heard and what was sent, whichever is in use.
    """

    needs_links = True
    least_room = max(Auction.least_room, Grants.least_room)

    def __init__(self, auction: Auction, grants: Grants, hearing: Hearing) -> None:
        super().__init__()
        self._auction = auction
        self._grants = grants
        self._hearing = hearing
        self._use(auction)
        self._is_new = True
        """Whether others may have turns of which we have not heard yet."""
        self._looked_at = -inf
        self._pair: Pair | None = None
        """Two robots that do not hear each other."""
        self._together_since = inf
        self._begins_at = inf
        """When we begin to plan, unless somebody else does."""
        self._first_plan_at = -inf
        self._back_s = BACK_S
        self._back_at = -inf
        """When the auction went on last."""

    @property
    def state(self) -> str:
        """What is in use and why, for people."""
        if self._in_use is self._grants:
            return f"{self._grants.state}; instead of the auction, as {self._why}"
        return self._auction.state + (f"; ends, as {self._why}" if self._pair else "")

    @property
    def lacks(self) -> str:  # type: ignore[override]
        """What the policy in use lacks. While the auction begins or ends, that is turns."""
        if self._in_use is self._auction and (self._is_new or self._pair is not None):
            return "turns by request"
        return self._in_use.lacks

    @property
    def tells_at(self) -> float:  # type: ignore[override]
        """When we have a plan to tell."""
        return self._begins_at if self._in_use is self._auction else self._grants.tells_at

    def mean_wait_s(self, qos: Qos) -> float:
        """That of the policy in use."""
        return self._in_use.mean_wait_s(qos)

    def carries(self, burst_s: float) -> float:
        """That of the policy in use."""
        return self._in_use.carries(burst_s)

    def slot(self, wish: Wish) -> Slot | None:
        """The slot of the policy in use; for a first plan, one that is won in the auction."""
        now = wish.sensed.until
        self._look(now)
        if self._in_use is self._grants:
            return self._grants.slot(wish)
        self._is_new = now < self._grants.round_s
        if self._is_new:
            return None
        if now < self._begins_at:
            return self._auction.slot(wish)
        slot = self._auction.slot(wish._replace(qos=Qos.URGENT))
        if slot is None or slot.is_pulse:
            return slot
        self._first_plan_at = slot.start
        self._fall(slot.start)
        return self._grants.begin(wish, slot.start)._replace(late_end=slot.start)

    def sent(self, end: float, src: int | None) -> None:
        """Note our burst; the auction goes on after a last plan."""
        super().sent(end, src)
        self._auction.sent(end, src)
        self._grants.sent(end, src)
        if self._grants.has_ended:
            self._go_back(end)

    def not_sent(self, start: float) -> None:
        """Note that a burst has not left; a first plan is told in another one."""
        super().not_sent(start)
        self._auction.not_sent(start)
        self._grants.not_sent(start)
        if start == self._first_plan_at and self._grants.plans:
            self._grants.end()
            self._use(self._auction)
            self._begins_at = start

    def heard(self, src: int, at: float, is_relayed: bool, *, is_weak: bool = False) -> None:
        """Note who is heard."""
        self._auction.heard(src, at, is_relayed)
        self._grants.heard(src, at, is_relayed, is_weak=is_weak)
        if not (is_relayed or is_weak):
            self._hearing.heard(src, at)

    def told_of(self, node: int, at: float, by: int, *, is_weak: bool = False) -> None:
        """Note that robot `by` hears robot `node`."""
        self._grants.told_of(node, at, by, is_weak=is_weak)
        if not is_weak:
            self._hearing.told_of(node, at, by)

    def know_links(self, edges: Edges) -> None:
        """Take the links of the team, as its LSAs tell them."""
        self._grants.know_links(edges)
        self._hearing.learn(edges)

    def beacon(self, src: int, at: float) -> None:
        """Look at who hears whom, also where nothing is to be sent."""
        self._look(at)

    def take_want(self, src: int, want: Want, at: float) -> None:
        """Take what a robot wants, for the policy in use."""
        self._in_use.take_want(src, want, at)

    def take_frame(self, src: int, frame: Frame, at: float) -> None:
        """Take the FRAME that comes with a plan."""
        self._grants.take_frame(src, frame, at)

    def take_grant(self, src: int, grant: Grant, at: float, *, is_weak: bool = False) -> None:
        """Follow a plan; after the last one, the auction goes on."""
        self._grants.take_grant(src, grant, at, is_weak=is_weak)
        if self._grants.has_ended:
            self._go_back(at)
        elif self._in_use is self._auction and self._grants.leads.follows:
            self._fall(at)

    def notices(self, now: float) -> list[str]:
        """Those of the policy in use, and who does not hear whom."""
        found = self._in_use.notices(now)
        if self._pair is not None:
            found.append(
                f"{self._why}: robots have turns by request instead of the auction until all hear "
                "each other"
            )
        return found

    @property
    def _why(self) -> str:
        if self._pair is None:
            return "not all robots heard each other lately"
        return "robots {} and {} do not hear each other".format(*self._pair)

    def _look(self, now: float) -> None:
        """Notice that robots do not hear each other, or that they do again."""
        if now < self._looked_at + LOOK_S:
            return
        self._looked_at = now
        grants, self._pair = self._grants, self._hearing.apart(now)
        is_sure = self._hearing.is_sure
        self._together_since = min(self._together_since, now) if is_sure else inf
        may_go_back = now >= self._together_since + self._back_s
        if self._in_use is self._auction:
            if self._pair is None:
                self._begins_at = inf
            elif self._begins_at == inf:
                self._begins_at = now + grants.leads.place(now) * PLACE_S
        elif grants.plans:
            grants.ends = may_go_back
        elif may_go_back and grants.leads.is_lost(now):
            # We have missed the end, or the root is gone.
            self._go_back(now)

    def _fall(self, now: float) -> None:
        """Go on by request."""
        is_flap = now < self._back_at + FLAP_S
        self._back_s = min(2 * self._back_s, MOST_BACK_S) if is_flap else BACK_S
        self._use(self._grants)
        self._begins_at = inf

    def _go_back(self, now: float) -> None:
        """Go on by auction."""
        self._grants.end()
        self._use(self._auction)
        self._begins_at, self._back_at = inf, now

    def _use(self, access: Auction | Grants) -> None:
        self._in_use = access
        self.by_request, self.by_auction = access.by_request, access.by_auction
        self.round_s, self.pause_s, self.share = access.round_s, access.pause_s, access.share
        self.others_follow = access.others_follow
