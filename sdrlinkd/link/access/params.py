"""What steers medium access. Defaults, ranges and meaning stand here and nowhere else."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Seconds = Annotated[float, Meta(ge=0, le=10)]


class AccessParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How robots share the air; the same at all of them. Times of 0 are made from the radio's."""

    policy: Literal["auto", "none", "csma", "minislot", "tdma"] = "auto"
    """auto: none where `nodes` lists nobody else, minislot where the radio reacts soon, else tdma.
    """
    nodes: list[Annotated[int, Meta(ge=0, le=254)]] = []
    """Robots that share it, in one order at all of them; for auto, minislot and tdma."""
    force: bool = False
    """Take a policy that carries less than half of what the best one would."""
    persist: Annotated[float, Meta(gt=0, le=1)] = 0.05
    """csma: chance to send in an idle slot (PERSIST)."""
    dwait_s: Seconds = 0.0
    """csma: pause after the channel was busy (DWAIT)."""
    slottime_s: Seconds = 0.0
    """csma: SLOTTIME; shorter than it takes to hear each other, it is none."""
    minislot_s: Seconds = 0.0
    """minislot, tdma: distance of the moments at which different robots may begin."""
    slot_s: Seconds = 0.0
    """tdma: a robot's slot."""
    guard_s: Seconds = 0.0
    """tdma: pause at the end of each slot."""
    reuse: bool = True
    """tdma: others may use a slot whose owner is silent."""
