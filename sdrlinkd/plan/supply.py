"""When a robot's radio gets to the air: what a message waits before its turn, and between turns."""

import math
from typing import NamedTuple

from sdrlinkd.link import PduLinkTraits, Qos, Settled

INFINITE = float("inf")
SECTIONS = 2
"""Sections of mini-slots: the higher level, and the lower."""
RARE = 0.01
"""Share of waits; csma draws by chance, and a wait that only so many exceed counts as longest."""


class Supply(NamedTuple):
    """When a robot may send, with times in s.

    `gap_s`: from a message that has just missed its chance to the first sample that can be its own,
    on an air that is otherwise idle. A turn then lasts `open_s`, and the next begins `closed_s`
    after it. `pause_s`: before each burst at the least, by class; `others`: robots whose bursts
    come between ours; each of ours waits for `passed_s` of mini-slots that are let pass.
    """

    gap_s: float
    open_s: float = INFINITE
    closed_s: float = 0.0
    pause_s: tuple[float, ...] = (0.0,) * len(Qos)
    passed_s: float = 0.0
    others: int = 0

    @property
    def share(self) -> float:
        """Share of the time that is this robot's own."""
        return 1.0 if self.open_s == INFINITE else self.open_s / (self.open_s + self.closed_s)

    def takes(self, demand_s: float) -> float:
        """Time in s from the begin of a turn to the end of `demand_s` on the air."""
        if self.open_s == INFINITE:
            return demand_s
        turns = max(0, math.ceil(demand_s / self.open_s - 1e-9) - 1)
        return demand_s + turns * self.closed_s


def supply_of(
    settled: Settled, traits: PduLinkTraits, robots: int, burst_s: float, pdu_s: float
) -> Supply:
    """The supply of one of `robots`.

    `burst_s`: the longest burst of its own, `pdu_s`: one PDU in it.
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
    if traits.tx_window_s < INFINITE:
        # Too late for a TX window is who comes `follow` before it ends.
        closed_s = traits.tx_window_follow_s + traits.rx_window_s
        return Supply(closed_s, traits.tx_window_s, closed_s)
    if settled.policy == "minislot":
        slot_s = access.pause_s
        pauses = tuple(slot_s * (1 + robots * (qos > Qos.LATENCY)) for qos in Qos)
        # On an idle air, up to a whole round; two robots may wish for one at the same time.
        return Supply(
            access.round_s + decided_s, pause_s=pauses, passed_s=robots * slot_s, others=robots - 1
        )
    if settled.policy == "csma":
        return _by_chance(settled, robots, decided_s)
    return Supply(decided_s)


def _one_window_a_slot(
    traits: PduLinkTraits, round_s: float, open_s: float, burst_s: float
) -> Supply:
    """The supply where a radio sends one TX window in a slot, and none in turns within its pause.

    Where the pause between TX windows is longer than what others have in between, turns are lost.
    """
    frames = max(1, math.ceil((burst_s + traits.rx_window_s) / round_s))
    return Supply(frames * round_s + traits.tx_window_follow_s, open_s, frames * round_s - open_s)


def _by_chance(settled: Settled, robots: int, decided_s: float) -> Supply:
    access = settled.access
    waits = tuple(access.mean_wait_s(qos) for qos in Qos)
    # Slots passed are geometric: ln(1/RARE) times their mean are exceeded by so many.
    longest_s = math.log(1 / RARE) * max(waits)
    return Supply(longest_s + decided_s, pause_s=waits, others=robots - 1)
