"""Turns that come whatever is asked for, as the robot that plans is far away."""

from math import ceil

from sdrlinkd.link import Opportunity
from sdrlinkd.link.access import Free, Slot
from tests.link.lossy import Air
from tests.link.world import PDU_S, airtime_s, use

ROUND_S = 0.04


class StandingTurns(Free):
    """A turn of one PDU in each round, whatever is asked for: the robot that plans is far away."""

    round_s = patience_s = ahead_s = ROUND_S
    plans = is_far = must_tell = False

    @property
    def by_request(self):
        return self

    def slot(self, wish):
        start = self.turn_at(wish.earliest)
        is_now = start - wish.earliest < ROUND_S / 10 and start > self.own_end
        return Slot(start, start + 1.5 * PDU_S) if is_now and wish.need_s <= PDU_S else None

    def turn_at(self, earliest):
        return ceil(earliest / ROUND_S - 1e-6) * ROUND_S

    def carries(self, burst_s):
        return PDU_S / ROUND_S

    def request(self, start, left):
        return None

    def requested(self, want, start):
        pass

    def told(self, start, length_s, room):
        return []


def in_turns(access, **kinds):
    """Two robots, whose turns come from an access policy each."""
    air = Air(**kinds)
    for link in air.links.values():
        use(link, access())
    air.next_burst = lambda link, now: link.next_burst(
        Opportunity(now, airtime_s, lambda _mcs, longest_s: int(longest_s / PDU_S))
    )
    return air
