"""Chooses the access policy that fits the radio, by how fast it reacts and what each carries."""

import math
from collections.abc import Mapping
from contextlib import suppress
from math import inf
from random import Random
from typing import Literal, NamedTuple

import msgspec

from sdrlinkd.errors import ConfigError
from sdrlinkd.link.access.base import Access
from sdrlinkd.link.access.choice import MANY, check_access, make_access, make_free, reaction_s
from sdrlinkd.link.access.params import AccessParams
from sdrlinkd.link.access.round_plan import MOST_TURNS
from sdrlinkd.link.traits import PduLinkTraits

SOON_S = 0.001
"""Longest reaction time in s for minislot and auction: from another's start until our radio holds
back."""
FAIR = 0.5
"""A policy is refused if it carries less than this share of what the best policy carries."""


Policy = Literal["auto", "none", "csma", "minislot", "auction", "tdma", "grant"]


class Settled(NamedTuple):
    """The policy in force, and why; `shares` is the share of airtime that each policy can use."""

    access: Access
    policy: Policy
    reason: str
    shares: Mapping[str, float]

    @property
    def share(self) -> float:
        """The share of airtime that the policy in force can use, 0 to 1."""
        return self.shares[self.policy]

    @property
    def best(self) -> str:
        """The policy that carries the most."""
        return max(self.shares, key=lambda each: self.shares[each])

    @property
    def sentence(self) -> str:
        """The policy in force, the reason, and its share of airtime, as a sentence for people."""
        return f"{self.policy}, {self.reason}; {percent(self.share)} of the airtime is usable"


def settle(
    params: AccessParams, own_id: int, traits: PduLinkTraits, longest_burst_s: float, rng: Random,
    room: int,
) -> Settled:  # fmt: skip
    """The access policy for this radio and bursts of at most `longest_burst_s`, with the reason.

    `room` is the number of octets for records in a PDU; 0: it can hold none. Robots with the same
    parameters and radios get the same result. Raises ConfigError if the radio does not support the
    policy, or if another policy carries twice as much.
    """
    check_access(params, own_id)
    policy, reason = params.policy, "as configured"
    if not traits.transmits:
        # Who never sends needs no turn, whatever the others do.
        policy, reason = "none", "because this radio only receives"
    possible: dict[str, Access] = {}
    if policy != "none" and (policy == "csma" or _others(params, own_id)):
        possible = _possible(params, own_id, traits, longest_burst_s)
    shares = {each: access.carries(longest_burst_s) for each, access in possible.items()}
    if policy == "auto":
        policy, reason = _chosen(params, own_id, traits, possible, shares, room)
    if policy == "none":
        is_alone = params.policy == "auto" and traits.senses and traits.shares_air
        access: Access = make_free(traits, is_alone)
        shares = {}
    else:
        wanted = msgspec.structs.replace(params, policy=policy)
        access = make_access(wanted, own_id, traits, longest_burst_s, rng)
    shares = {**shares, policy: access.carries(longest_burst_s)}
    settled = Settled(access, policy, reason, shares)
    if not params.force:
        _refuse_poor(settled, max(2, len(set(params.nodes))))
    return settled


def may_share(params: AccessParams, own_id: int) -> bool:
    """Whether the robot may share the channel, as far as that is known without a radio."""
    if params.policy == "auto":
        return bool(_others(params, own_id))
    return params.policy != "none"


def _possible(
    params: AccessParams, own_id: int, traits: PduLinkTraits, longest_burst_s: float
) -> dict[str, Access]:
    """The policies that the radio supports, with times that follow from it."""
    found: dict[str, Access] = {}
    policies: tuple[Policy, ...] = ("csma", "minislot", "auction", "tdma", "grant")
    # csma does not need `nodes`; without them, assume one other robot.
    nodes = params.nodes or [own_id, (own_id + 1) % 255]
    for policy in policies:
        wanted = AccessParams(policy=policy, nodes=nodes, persist=params.persist)
        with suppress(ConfigError):
            found[policy] = make_access(wanted, own_id, traits, longest_burst_s, Random(0))
    return found


def percent(share: float) -> str:
    """A share from 0 to 1 as text in per cent: `93 %`, `6.6 %`."""
    return f"{100 * share:.2g} %" if share < 0.995 else "100 %"


def _others(params: AccessParams, own_id: int) -> set[int]:
    return set(params.nodes) - {own_id}


def _chosen(
    params: AccessParams, own_id: int, traits: PduLinkTraits, possible: Mapping[str, Access],
    shares: Mapping[str, float], room: int,
) -> tuple[Policy, str]:  # fmt: skip
    """The (policy, reason) that `auto` chooses for this radio."""
    if not (traits.shares_air and traits.senses):
        return "none", f'because no other robot shares the backend "{traits.kind}"'
    if not _others(params, own_id):
        return "none", "because access.nodes lists no other robot"
    apart_s, n = reaction_s(traits), len(set(params.nodes))
    reacts = f"because this radio takes {1e3 * apart_s:.3g} ms to notice another robot's burst"
    fair = {each for each in shares if shares[each] >= FAIR * max(shares.values())}
    has_room = {each for each, access in possible.items() if room >= access.least_room}
    # Two robots have so few mini-slots that these cost less than a contest.
    quick: Policy = "auction" if n >= MANY and "auction" in has_room else "minislot"
    if apart_s <= SOON_S and quick in fair:
        return quick, reacts
    if apart_s > SOON_S:
        why = f"{reacts}; {quick} allows at most {1e3 * SOON_S:g} ms"
    else:
        why = (
            f"because with {n} robots {quick} leaves {percent(shares[quick])} of the airtime "
            f"usable and tdma {percent(shares['tdma'])}"
        )
    # In TX windows, a turn may be longer than the radio can send at a time.
    may_grant = "grant" in has_room & fair and traits.tx_window_s == inf
    grant_s = possible["grant"].round_s * math.ceil((n - 1) / MOST_TURNS)
    tdma_s = possible["tdma"].round_s
    if may_grant and grant_s < tdma_s:
        return "grant", (
            f"{why}; all have had a turn after {1e3 * grant_s:.3g} ms, and in tdma after "
            f"{1e3 * tdma_s:.3g} ms"
        )
    return "tdma", why


def _refuse_poor(settled: Settled, n: int) -> None:
    best, share = settled.best, settled.share
    if share < FAIR * settled.shares[best]:
        raise ConfigError(
            f'access.policy: got "{settled.policy}", which leaves {percent(share)} of the '
            f"airtime usable with {n} robots on this radio, where {best} leaves "
            f"{percent(settled.shares[best])}; "
            f'allowed: "auto" or "{best}", or access.force = true'
        )
