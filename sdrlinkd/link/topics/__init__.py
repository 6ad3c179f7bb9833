"""Which topics there are: our own, by registry or declaration, and those that others declare.

This package owns the numbers of declared topics and decides when they are told to other robots. It
never sees a message.
"""

from sdrlinkd.link.topics.heard import HeardTopic, HeardTopics
from sdrlinkd.link.topics.own import MOST_KEYS, N_NUMBERS, Offer, OwnTopics
from sdrlinkd.link.topics.telling import TELLING_SHARE, TopicTeller

__all__ = [
    "MOST_KEYS",
    "N_NUMBERS",
    "TELLING_SHARE",
    "HeardTopic",
    "HeardTopics",
    "Offer",
    "OwnTopics",
    "TopicTeller",
]
