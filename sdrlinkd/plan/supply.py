"""Models when a robot may send: the wait for a turn, and between turns."""

import math
from typing import NamedTuple

from sdrlinkd.link import PduLinkTraits, Qos, Settled

INFINITE = float("inf")
SECTIONS = 2
"""Number of sections of mini-slots: the higher level and the lower."""
LEVEL = Qos.LATENCY
"""Least urgent class of the higher level, which all robots serve first; within a level they take
turns."""
RARE = 0.01
"""Share of csma's random waits that may exceed the wait that counts as the longest."""


class Supply(NamedTuple):
    """When a robot may send; times are in s.

    `gap_s` is the longest time, on an otherwise idle channel, from a message that has just missed
    its turn to its first possible sample. A turn then lasts `open_s`, and the next one starts
    `closed_s` after it. `pause_s` is the shortest pause before each burst, by class. `others` is
    the number of robots whose bursts come between ours. Each of our bursts waits for `passed_s`
    while unused mini-slots pass. What is not urgent gives way for `gives_way_s` at most to urgent
    messages that are expected.
    """

    gap_s: float
    open_s: float = INFINITE
    closed_s: float = 0.0
    pause_s: tuple[float, ...] = (0.0,) * len(Qos)
    passed_s: float = 0.0
    others: int = 0
    gives_way_s: float = 0.0

    @property
    def share(self) -> float:
        """Share of the time in which this robot may send."""
        return 1.0 if self.open_s == INFINITE else self.open_s / (self.open_s + self.closed_s)

    def takes(self, demand_s: float) -> float:
        """Time in s from the start of a turn until `demand_s` of airtime is served."""
        if self.open_s == INFINITE:
            return demand_s
        turns = max(0, math.ceil(demand_s / self.open_s - 1e-9) - 1)
        return demand_s + turns * self.closed_s


def supply_of(
    settled: Settled, traits: PduLinkTraits, robots: int, burst_s: float, pdu_s: float
) -> Supply:
    """The supply of one of `robots`.

    `burst_s` is the length of its longest burst, `pdu_s` that of one PDU.
    """
    access = settled.access
    decided_s = traits.lead_s + traits.ahead_s
    if settled.policy == "tdma":
        slot_s = access.share * access.round_s
        open_s = max(burst_s, slot_s - 2 * pdu_s)
        if traits.tx_window_s < INFINITE:
            return _one_window_a_slot(traits, access.round_s, open_s, burst_s)
        missed_s = max(burst_s, access.step_s)
        gap_s = access.round_s - slot_s + missed_s + decided_s + traits.react_s
        return Supply(gap_s, open_s, access.round_s - open_s)
    if settled.policy == "grant":
        # With requests from everybody, a robot has its part of the budget in each round.
        open_s = max(pdu_s, access.share * access.round_s)
        gap_s, closed_s = access.round_s + decided_s + traits.react_s, access.round_s - open_s
        patience_s = 0.0 if access.by_request is None else access.by_request.patience_s
        return Supply(gap_s, open_s, closed_s, gives_way_s=patience_s + access.round_s)
    if traits.tx_window_s < INFINITE:
        # A message that comes less than `follow` before the end of a TX window misses it.
        closed_s = traits.tx_window_follow_s + traits.rx_window_s
        return Supply(closed_s, traits.tx_window_s, closed_s)
    if settled.policy == "minislot":
        slot_s = access.pause_s
        pauses = tuple(slot_s * (1 + robots * (qos > Qos.LATENCY)) for qos in Qos)
        # On an idle channel, wait up to a whole round; two robots may want the same one.
        return Supply(
            access.round_s + decided_s, pause_s=pauses, passed_s=robots * slot_s, others=robots - 1
        )
    if settled.policy == "auction":
        pauses = (access.pause_s,) * len(Qos)
        # Wait for a round that has begun, and then for a contest.
        gap_s = access.pause_s + access.round_s + decided_s
        return Supply(gap_s, pause_s=pauses, others=robots - 1)
    if settled.policy == "csma":
        return _by_chance(settled, robots, decided_s)
    return Supply(decided_s)


def _one_window_a_slot(
    traits: PduLinkTraits, round_s: float, open_s: float, burst_s: float
) -> Supply:
    """The supply of a radio that sends one TX window per slot, and none within its pause.

    If the pause between TX windows is longer than the others' slots in between, turns are lost.
    """
    frames = max(1, math.ceil((burst_s + traits.rx_window_s) / round_s))
    return Supply(frames * round_s + traits.tx_window_follow_s, open_s, frames * round_s - open_s)


def _by_chance(settled: Settled, robots: int, decided_s: float) -> Supply:
    access = settled.access
    waits = tuple(access.mean_wait_s(qos) for qos in Qos)
    # The slots passed are geometric, so a share of RARE exceeds ln(1/RARE) times their mean.
    longest_s = math.log(1 / RARE) * max(waits)
    return Supply(longest_s + decided_s, pause_s=waits, others=robots - 1)
