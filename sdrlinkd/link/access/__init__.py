"""Medium access: when a node may send on a shared channel.

This package holds the access policies, each a state machine over the link's clock, and chooses one
that fits the radio. It never reads a message, and decides only when to send.
"""

from sdrlinkd.link.access.auto import Settled, may_share, percent, settle
from sdrlinkd.link.access.base import Access, Slot, Wish
from sdrlinkd.link.access.choice import (
    CLOCK_ERROR_S,
    LONGEST_APART_S,
    LONGEST_ROUND_S,
    MARGIN_S,
    check_access,
    make_access,
)
from sdrlinkd.link.access.csma import STEPS as CSMA_STEPS
from sdrlinkd.link.access.csma import WINDOWS as CSMA_WINDOWS
from sdrlinkd.link.access.csma import Csma
from sdrlinkd.link.access.free import Free
from sdrlinkd.link.access.idle import idle_words
from sdrlinkd.link.access.minislot import LEVELS, MiniSlots
from sdrlinkd.link.access.params import AccessParams
from sdrlinkd.link.access.steps import after
from sdrlinkd.link.access.tdma import FORGET_S, LISTEN_S, Tdma
from sdrlinkd.link.access.tdma_states import STEPS as TDMA_STEPS

__all__ = [
    "CLOCK_ERROR_S",
    "CSMA_STEPS",
    "CSMA_WINDOWS",
    "FORGET_S",
    "LEVELS",
    "LISTEN_S",
    "LONGEST_APART_S",
    "LONGEST_ROUND_S",
    "MARGIN_S",
    "TDMA_STEPS",
    "Access",
    "AccessParams",
    "Csma",
    "Free",
    "MiniSlots",
    "Settled",
    "Slot",
    "Tdma",
    "Wish",
    "after",
    "check_access",
    "idle_words",
    "make_access",
    "may_share",
    "percent",
    "settle",
]
