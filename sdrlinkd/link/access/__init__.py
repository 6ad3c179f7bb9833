"""Medium access: when a node may send on an air that it shares."""

from sdrlinkd.link.access.auto import Settled, may_share, percent, settle
from sdrlinkd.link.access.base import Access, Slot, Wish
from sdrlinkd.link.access.choice import check_access, make_access
from sdrlinkd.link.access.free import Free
from sdrlinkd.link.access.idle import idle_words
from sdrlinkd.link.access.minislot import MiniSlots
from sdrlinkd.link.access.params import AccessParams

__all__ = [
    "Access",
    "AccessParams",
    "Free",
    "MiniSlots",
    "Settled",
    "Slot",
    "Wish",
    "check_access",
    "idle_words",
    "make_access",
    "may_share",
    "percent",
    "settle",
]
