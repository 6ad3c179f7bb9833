"""Which topics there are: our own, by registry or declaration, and those that others declare.

This package owns the numbers of declared topics, and knows which of them somebody subscribes to. It
decides when both are told to other robots. It never sees a message.
"""

from sdrlinkd.link.topics.demand import LEASE_S, Demand
from sdrlinkd.link.topics.heard import (
    FREE,
    MOST_OF_ALL,
    MOST_OF_ONE,
    MOST_TOLD,
    HeardTopic,
    HeardTopics,
)
from sdrlinkd.link.topics.own import IDLE_S, MOST_KEYS, N_NUMBERS, Offer, OwnTopics
from sdrlinkd.link.topics.telling import TELLING_SHARE, TopicTeller
from sdrlinkd.link.topics.wants import NOTHING, Wants

__all__ = [
    "FREE",
    "IDLE_S",
    "LEASE_S",
    "MOST_KEYS",
    "MOST_OF_ALL",
    "MOST_OF_ONE",
    "MOST_TOLD",
    "NOTHING",
    "N_NUMBERS",
    "TELLING_SHARE",
    "Demand",
    "HeardTopic",
    "HeardTopics",
    "Offer",
    "OwnTopics",
    "TopicTeller",
    "Wants",
]
