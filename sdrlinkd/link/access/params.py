"""Settings of medium access; their defaults, ranges and meanings are defined only here."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Seconds = Annotated[float, Meta(ge=0, le=10)]


class AccessParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How robots share the channel, the same at all robots; a time of 0 follows from the radio."""

    policy: Literal["auto", "none", "csma", "minislot", "auction", "tdma", "grant"] = "auto"
    """Access policy; auto: none if `nodes` lists no other robot; minislot for two and auction for
    more, if the radio reacts fast enough; else grant or tdma, whose turns come sooner."""
    nodes: list[Annotated[int, Meta(ge=0, le=254)]] = []
    """Ids of the robots that share the channel, in the same order at all robots; for all policies
    but none and csma."""
    force: bool = False
    """Whether to accept a policy that carries less than half of what the best policy would."""
    persist: Annotated[float, Meta(gt=0, le=1)] = 0.05
    """csma: probability of sending in an idle slot (PERSIST)."""
    dwait_s: Seconds = 0.0
    """csma: pause after a busy channel in s (DWAIT)."""
    slottime_s: Seconds = 0.0
    """csma: slot time in s (SLOTTIME); it must be long enough to hear another robot's start."""
    minislot_s: Seconds = 0.0
    """minislot, auction, tdma: distance in s between the starts allowed to different robots."""
    slot_s: Seconds = 0.0
    """tdma: length of a robot's slot in s."""
    guard_s: Seconds = 0.0
    """tdma, grant: guard time in s at the end of each slot, and after each turn."""
    reuse: bool = True
    """tdma: whether others may use a slot whose owner is silent."""
