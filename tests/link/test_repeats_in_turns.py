"""Repeats where turns are given by request, and the one that was asked for does not come."""

from math import ceil, inf

import pytest

from sdrlinkd.link import Opportunity, Overrides, Qos
from sdrlinkd.link.access import Free, Slot
from tests.link.lossy import Air, once
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


@pytest.mark.parametrize(("qos", "comes"), [(Qos.URGENT, True), (Qos.LATENCY, False)])
def test_what_is_urgent_is_announced_in_one_turn_and_repeated_in_the_next(qos, comes):
    air = in_turns(StandingTurns, lost=once(3), share=0.5)
    air.run(1.0)
    air.flow(1, 6, every_s=0.3, overrides=Overrides(qos=qos, lifespan_s=inf))
    air.run(air.now + 0.5)
    assert (3 in air.numbers(2)) == comes
    assert set(air.numbers(2)) >= {0, 1, 2, 4, 5}
    assert max(len(burst.pdus) for _, _, burst in air.bursts) == 1
