"""Which topics there are: our own, by registry or declaration, and those that others declare.

This package owns the numbers of declared topics and decides when they are told to other robots. It
never sees a message.
"""

from sdrlinkd.link.topics.heard import HeardTopic, HeardTopics
from sdrlinkd.link.topics.own import Offer, OwnTopics
from sdrlinkd.link.topics.telling import TopicTeller

__all__ = ["HeardTopic", "HeardTopics", "Offer", "OwnTopics", "TopicTeller"]
