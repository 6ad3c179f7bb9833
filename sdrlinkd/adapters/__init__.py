"""Adapters to the outside: recordings, message types, chronyd, and a robot for demonstrations."""

from sdrlinkd.adapters.bags import Bag, BagMessage, BagTopic, open_bag
from sdrlinkd.adapters.chrony import ChronySocket
from sdrlinkd.adapters.due import Due, due_messages
from sdrlinkd.adapters.fields import cdr_from_fields
from sdrlinkd.adapters.pacing import first_seconds, paced
from sdrlinkd.adapters.robot import BuiltInRobot
from sdrlinkd.adapters.stops import header_topics, stop_messages
from sdrlinkd.adapters.summary import BagSummary, TopicSummary, summarise
from sdrlinkd.adapters.transforms import Transforms
from sdrlinkd.adapters.typestore import empty, from_cdr, knows, to_cdr

__all__ = [
    "Bag",
    "BagMessage",
    "BagSummary",
    "BagTopic",
    "BuiltInRobot",
    "ChronySocket",
    "Due",
    "TopicSummary",
    "Transforms",
    "cdr_from_fields",
    "due_messages",
    "empty",
    "first_seconds",
    "from_cdr",
    "header_topics",
    "knows",
    "open_bag",
    "paced",
    "stop_messages",
    "summarise",
    "to_cdr",
]
