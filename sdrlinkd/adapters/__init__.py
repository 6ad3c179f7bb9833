"""Adapters to the outside: recordings, message types, chronyd, and a robot for demonstrations."""

from sdrlinkd.adapters.bags import Bag, BagMessage, BagQos, BagTopic, open_bag
from sdrlinkd.adapters.chrony import ChronySocket
from sdrlinkd.adapters.due import Due, due_messages
from sdrlinkd.adapters.fields import cdr_from_fields, check_cdr
from sdrlinkd.adapters.mcap_file import McapFile, Recorded
from sdrlinkd.adapters.message_types import MessageTypes, unknown_types
from sdrlinkd.adapters.pacing import first_seconds, from_second, paced
from sdrlinkd.adapters.places import PLACES, SHARED_FRAMES, Fix, Place, read_place
from sdrlinkd.adapters.recorder import BagWriter
from sdrlinkd.adapters.robot import BuiltInRobot
from sdrlinkd.adapters.summary import BagSummary, TopicSummary, summarise
from sdrlinkd.adapters.transforms import Transforms
from sdrlinkd.adapters.typestore import definition, empty, from_cdr, knows, to_cdr, type_hash

__all__ = [
    "PLACES",
    "SHARED_FRAMES",
    "Bag",
    "BagMessage",
    "BagQos",
    "BagSummary",
    "BagTopic",
    "BagWriter",
    "BuiltInRobot",
    "ChronySocket",
    "Due",
    "Fix",
    "McapFile",
    "MessageTypes",
    "Place",
    "Recorded",
    "TopicSummary",
    "Transforms",
    "cdr_from_fields",
    "check_cdr",
    "definition",
    "due_messages",
    "empty",
    "first_seconds",
    "from_cdr",
    "from_second",
    "knows",
    "open_bag",
    "paced",
    "read_place",
    "summarise",
    "to_cdr",
    "type_hash",
    "unknown_types",
]
