"""Medium access: when a node may send on a shared channel.

This package holds the access policies, each a state machine over the link's clock, and chooses one
that fits the radio. It never reads a message, and decides only when to send.
"""

from sdrlinkd.link.access.auction import PATIENCE as AUCTION_PATIENCE
from sdrlinkd.link.access.auction import Auction
from sdrlinkd.link.access.auto import Settled, may_share, percent, settle
from sdrlinkd.link.access.base import Access, Slot, Wish
from sdrlinkd.link.access.by_auction import ByAuction
from sdrlinkd.link.access.by_hearing import BACK_S, ByHearing
from sdrlinkd.link.access.by_request import ByRequest
from sdrlinkd.link.access.choice import (
    CLOCK_ERROR_S,
    LONGEST_APART_S,
    LONGEST_ROUND_S,
    MARGIN_S,
    check_access,
    make_access,
    make_auction,
)
from sdrlinkd.link.access.contest import Contest, n_bits
from sdrlinkd.link.access.csma import STEPS as CSMA_STEPS
from sdrlinkd.link.access.csma import WINDOWS as CSMA_WINDOWS
from sdrlinkd.link.access.csma import Csma
from sdrlinkd.link.access.free import Free
from sdrlinkd.link.access.grant import Grants
from sdrlinkd.link.access.idle import idle_words
from sdrlinkd.link.access.minislot import LEVELS, MiniSlots
from sdrlinkd.link.access.params import AccessParams
from sdrlinkd.link.access.requests import Due, Waiting, together, waiting_of, want_of
from sdrlinkd.link.access.reuse import Apart, stages, told
from sdrlinkd.link.access.round_plan import (
    LEAST_TURNS,
    Times,
    account,
    before,
    plan,
    shares,
)
from sdrlinkd.link.access.round_plan import STANDS as TURN_STANDS
from sdrlinkd.link.access.steps import after
from sdrlinkd.link.access.tdma import FORGET_S, LISTEN_S, Tdma
from sdrlinkd.link.access.tdma_states import STEPS as TDMA_STEPS
from sdrlinkd.link.access.team import places_of
from sdrlinkd.link.access.turns import ALMOST_S, Ticks

__all__ = [
    "ALMOST_S",
    "AUCTION_PATIENCE",
    "BACK_S",
    "CLOCK_ERROR_S",
    "CSMA_STEPS",
    "CSMA_WINDOWS",
    "FORGET_S",
    "LEAST_TURNS",
    "LEVELS",
    "LISTEN_S",
    "LONGEST_APART_S",
    "LONGEST_ROUND_S",
    "MARGIN_S",
    "TDMA_STEPS",
    "TURN_STANDS",
    "Access",
    "AccessParams",
    "Apart",
    "Auction",
    "ByAuction",
    "ByHearing",
    "ByRequest",
    "Contest",
    "Csma",
    "Due",
    "Free",
    "Grants",
    "MiniSlots",
    "Settled",
    "Slot",
    "Tdma",
    "Ticks",
    "Times",
    "Waiting",
    "Wish",
    "account",
    "after",
    "before",
    "check_access",
    "idle_words",
    "make_access",
    "make_auction",
    "may_share",
    "n_bits",
    "percent",
    "places_of",
    "plan",
    "settle",
    "shares",
    "stages",
    "together",
    "told",
    "waiting_of",
    "want_of",
]
