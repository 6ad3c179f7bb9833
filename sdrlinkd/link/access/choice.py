"""Builds an access policy from the settings and the radio's traits, or refuses with a reason."""

import math
from random import Random

from sdrlinkd.errors import ConfigError
from sdrlinkd.link.access.auction import Auction
from sdrlinkd.link.access.base import Access
from sdrlinkd.link.access.by_hearing import ByHearing
from sdrlinkd.link.access.csma import Csma
from sdrlinkd.link.access.free import Free
from sdrlinkd.link.access.grant import Grants
from sdrlinkd.link.access.hearing import Hearing
from sdrlinkd.link.access.minislot import SECTIONS, MiniSlots
from sdrlinkd.link.access.params import AccessParams
from sdrlinkd.link.access.round_plan import MOST_TURNS, Times
from sdrlinkd.link.access.tdma import Tdma
from sdrlinkd.link.access.turns import Ticks
from sdrlinkd.link.traits import PduLinkTraits

GUARD_SHARE = 0.1
"""Largest share of a tdma slot that its guard time may take."""
CLOCK_ERROR_S = 1.5e-4
"""Error in s of two robots' clocks in tdma: 40 ppm while one follows another unheard (FORGET_S)."""
MARGIN_S = 5e-6
"""Margin in s for multipath and for propagation over about a kilometre."""
BUDGET_TIMES, BUDGET_S = 4.0, 0.1
"""grant: airtime of a round beyond the least turns, as a multiple of them, and its limit in s."""
DRIFT, DRIFT_ROUNDS = 4e-5, 3
"""grant: how fast two crystals drift apart, and for how many rounds a plan may not be heard."""
MOST_TICKS = 240
HEARS_SHARE = 0.1
"""grant: most time for which the root waits to hear the last turn, as a share of the budget."""
LONGEST_ROUND_S = 1.0
MANY = 3
"""auction: robots from which some may not hear others that are here."""
LONGEST_APART_S = 0.1
"""Longest reaction time in s of a radio for which listening before sending makes sense."""


def check_access(params: AccessParams, own_id: int) -> None:
    """Check what can be checked without a radio. Raises ConfigError."""
    if params.policy in ("minislot", "auction", "tdma", "grant") or (
        params.policy == "auto" and params.nodes
    ):
        if own_id not in params.nodes:
            raise ConfigError(
                f"access.nodes: got {params.nodes}; allowed with access.policy = "
                f'"{params.policy}": the ids of all robots that share the air, in the same order '
                f"at each of them, this robot's {own_id} among them"
            )
        if len(set(params.nodes)) != len(params.nodes):
            raise ConfigError(f"access.nodes: got {params.nodes}; allowed: each robot once")


def make_access(
    params: AccessParams, own_id: int, traits: PduLinkTraits, longest_burst_s: float, rng: Random
) -> Access:
    """The configured policy (not auto) for bursts of at most `longest_burst_s`.

    Raises ConfigError if the radio does not support it.
    """
    check_access(params, own_id)
    if params.policy == "auto":
        raise ValueError("auto is not a policy: settle it first")
    if params.policy == "none":
        return make_free(traits)
    _refuse_deaf(params, traits)
    detect_s = traits.detect_s + MARGIN_S
    apart_s = reaction_s(traits)
    if params.policy in ("csma", "minislot", "auction") and apart_s > LONGEST_APART_S:
        raise ConfigError(
            f'access.policy: got "{params.policy}"; this radio detects other robots\' bursts '
            f"only after {apart_s * 1e3:.3g} ms; allowed: at most {LONGEST_APART_S * 1e3:g} ms: "
            "use tdma"
        )
    if params.policy == "csma":
        slottime_s = params.slottime_s or apart_s
        dwait_s = params.dwait_s or slottime_s
        robots = max(2, len(set(params.nodes)))
        return Csma(dwait_s, slottime_s, params.persist, detect_s, rng, robots)
    minislot_s = params.minislot_s or apart_s
    if params.policy == "minislot":
        _refuse_short("minislot_s", minislot_s, apart_s, traits)
        round_s = SECTIONS * len(params.nodes) * minislot_s
        if round_s > LONGEST_ROUND_S:
            raise ConfigError(
                f'access.policy: got "minislot"; with {len(params.nodes)} robots and a radio that '
                f"needs {minislot_s * 1e3:.3g} ms for each, a round takes {round_s:.3g} s; "
                f"allowed: at most {LONGEST_ROUND_S:g} s: use tdma, or fewer robots"
            )
        return MiniSlots(own_id, params.nodes, minislot_s, detect_s)
    if params.policy == "auction":
        auction = make_auction(params, own_id, traits)
        if len(params.nodes) < MANY:
            return auction
        grants = _make_grant(params, own_id, traits, longest_burst_s, rng)
        return ByHearing(auction, grants, Hearing(own_id, params.nodes))
    if params.policy == "grant":
        return _make_grant(params, own_id, traits, longest_burst_s, rng)
    return _make_tdma(params, own_id, traits, longest_burst_s, apart_s, rng)


def make_auction(params: AccessParams, own_id: int, traits: PduLinkTraits) -> Auction:
    """The auction itself, without a fall-back. Raises ConfigError if the radio sends no pulses."""
    if not traits.pulse_s:
        raise ConfigError(
            f'access.policy: got "auction", but the backend "{traits.kind}" sends no pulses; '
            'allowed: "auto" or "grant"'
        )
    # A pulse is known when it is over: two quiet windows after the one in which it ends.
    detect_s = traits.pulse_s + 1.5 * traits.detect_s + MARGIN_S
    least_s = traits.lead_s + traits.react_s + detect_s
    minislot_s = params.minislot_s or least_s
    _refuse_short("minislot_s", minislot_s, least_s, traits)
    return Auction(own_id, params.nodes, minislot_s, detect_s)


def make_free(traits: PduLinkTraits, is_alone: bool = False) -> Free:
    """The policy `none`; with `is_alone`, no other robot should be on this channel."""
    return Free(
        2 * traits.turnaround_s, traits.gap_s, traits.tx_window_s, traits.rx_window_s, is_alone
    )


def reaction_s(traits: PduLinkTraits) -> float:
    """Shortest distance of two starts, in s, at which the second robot hears the first in time."""
    return traits.lead_s + traits.react_s + traits.detect_s + MARGIN_S


def _make_tdma(
    params: AccessParams,
    own_id: int,
    traits: PduLinkTraits,
    longest_burst_s: float,
    apart_s: float,
    rng: Random,
) -> Tdma:
    # In tdma, robots do not count from the end of a common burst but by their own clocks.
    apart_s += CLOCK_ERROR_S
    minislot_s = params.minislot_s or apart_s
    least_s = traits.turnaround_s + CLOCK_ERROR_S + MARGIN_S + 2 * traits.index_error_s
    guard_s = params.guard_s or least_s
    _refuse_short("guard_s", guard_s, least_s - CLOCK_ERROR_S, traits)
    # Room for the gaps of two bursts, so that an urgent message may come between them.
    longest_s = longest_burst_s + traits.overhead_s + 2 * traits.gap_s
    bursts = max(1, math.ceil(guard_s * (1 / GUARD_SHARE - 1) / longest_s))
    slot_s = params.slot_s or 1e-5 * math.ceil(1e5 * (bursts * longest_s + guard_s))
    if slot_s < longest_s + guard_s:
        raise ConfigError(
            f"access.slot_s: got {slot_s:g}; allowed: at least {longest_s + guard_s:.4g} s, room "
            f"for the longest burst ({longest_s * 1e3:.3g} ms) and a guard of "
            f"{guard_s * 1e3:.3g} ms"
        )
    return Tdma(
        own_id,
        params.nodes,
        slot_s,
        guard_s,
        minislot_s,
        # No reuse where a slot would end before others could find it unused.
        params.reuse and apart_s <= minislot_s < slot_s - guard_s - traits.overhead_s,
        rng,
        look_s=traits.react_s + traits.ahead_s,
        detect_s=traits.detect_s + MARGIN_S + CLOCK_ERROR_S,
        gap_s=traits.gap_s,
    )


def _make_grant(
    params: AccessParams, own_id: int, traits: PduLinkTraits, longest_burst_s: float, rng: Random
) -> Grants:
    n = len(params.nodes)
    turn_s = max(traits.pdu_burst_s, default=longest_burst_s) + traits.gap_s
    react_s = traits.react_s + traits.lead_s + traits.ahead_s + traits.detect_s + MARGIN_S
    guard_s = traits.turnaround_s + traits.gap_s + MARGIN_S + 2 * traits.index_error_s
    least_s = react_s + min(n, MOST_TURNS + 1) * (turn_s + guard_s)
    budget_s = max(least_s, min(BUDGET_TIMES * least_s, BUDGET_S))
    # Clocks drift apart while some plans are not heard.
    guard_s += DRIFT * DRIFT_ROUNDS * (budget_s + least_s)
    # The guard time is a whole number of ticks, so that turns can begin together.
    guard_s = max(params.guard_s, guard_s)
    least_tick_s = (budget_s + turn_s) / MOST_TICKS
    per_guard = max(1, int(guard_s / least_tick_s))
    tick_us = math.ceil(1e6 * max(least_tick_s, guard_s / per_guard))
    ticks = Ticks(1e-6 * tick_us, 1e-6 * tick_us * per_guard)
    guard_s = ticks.guard_s
    look_s = traits.react_s + (0.0 if traits.is_lockstep else traits.ahead_s)
    hears_s = max(guard_s, min(traits.lead_s + look_s, HEARS_SHARE * budget_s))
    longest_s = longest_burst_s + traits.overhead_s
    times = Times(ticks, turn_s, budget_s, longest_s, hears_s, react_s)
    return Grants(
        own_id, params.nodes, times, rng, lead_s=traits.lead_s, look_s=look_s, gap_s=traits.gap_s
    )


def _refuse_deaf(params: AccessParams, traits: PduLinkTraits) -> None:
    if not traits.senses:
        raise ConfigError(
            f'access.policy: got "{params.policy}", but the backend "{traits.kind}" does not sense '
            'the channel; allowed: "none"'
        )


def _refuse_short(key: str, given_s: float, least_s: float, traits: PduLinkTraits) -> None:
    if given_s < least_s * (1 - 1e-6):
        raise ConfigError(
            f"access.{key}: got {given_s:g}; this radio ({traits.kind}: turnaround "
            f"{traits.turnaround_s * 1e3:.3g} ms, lead {traits.lead_s * 1e3:.3g} ms, reaction "
            f"{traits.react_s * 1e3:.3g} ms) needs at least {least_s:.4g} s; allowed: that or more "
            "at all robots, or 0 (derived from the radio)"
        )
