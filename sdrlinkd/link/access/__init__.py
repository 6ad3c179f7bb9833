"""Medium access: when a node may send on an air that it shares."""

from sdrlinkd.link.access.auto import Settled, may_share, percent, settle
from sdrlinkd.link.access.base import Access, Slot, Wish
from sdrlinkd.link.access.choice import check_access, make_access
from sdrlinkd.link.access.csma import STEPS as CSMA_STEPS
from sdrlinkd.link.access.free import Free
from sdrlinkd.link.access.idle import idle_words
from sdrlinkd.link.access.minislot import MiniSlots
from sdrlinkd.link.access.params import AccessParams
from sdrlinkd.link.access.steps import IllegalStepError, after
from sdrlinkd.link.access.tdma_states import STEPS as TDMA_STEPS

__all__ = [
    "CSMA_STEPS",
    "TDMA_STEPS",
    "Access",
    "AccessParams",
    "Free",
    "IllegalStepError",
    "MiniSlots",
    "Settled",
    "Slot",
    "Wish",
    "after",
    "check_access",
    "idle_words",
    "make_access",
    "may_share",
    "percent",
    "settle",
]
