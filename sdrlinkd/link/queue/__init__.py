"""The queue of messages to be sent: their order, and which messages are refused.

This package holds the queue, the topics' policies, and the ledger's table of reasons. It builds no
PDUs and knows nothing of radio or channel.
"""

from sdrlinkd.link.queue.admission import NOT_TAKEN
from sdrlinkd.link.queue.compression import Deflated, Inflated, most_expanded, train_dictionary
from sdrlinkd.link.queue.fair import HEAD_START, Level, with_first
from sdrlinkd.link.queue.fate import STEPS, Fate, Step
from sdrlinkd.link.queue.intake import Intake
from sdrlinkd.link.queue.latched import Kept, Latched, Offer
from sdrlinkd.link.queue.ledger import (
    RX_PDU_REASONS,
    RX_REASONS,
    TX_REASONS,
    RxTally,
    TxTally,
    balance,
)
from sdrlinkd.link.queue.lifespan import Lifespan, lifespan_of
from sdrlinkd.link.queue.lives import Lives
from sdrlinkd.link.queue.message import Lane, Outgoing
from sdrlinkd.link.queue.outbox import Outbox
from sdrlinkd.link.queue.policy import DEFAULT_POLICY, TopicPolicy
from sdrlinkd.link.queue.policy_table import PolicyTable, TypePolicies

__all__ = [
    "DEFAULT_POLICY",
    "HEAD_START",
    "NOT_TAKEN",
    "RX_PDU_REASONS",
    "RX_REASONS",
    "STEPS",
    "TX_REASONS",
    "Deflated",
    "Fate",
    "Inflated",
    "Intake",
    "Kept",
    "Lane",
    "Latched",
    "Level",
    "Lifespan",
    "Lives",
    "Offer",
    "Outbox",
    "Outgoing",
    "PolicyTable",
    "RxTally",
    "Step",
    "TopicPolicy",
    "TxTally",
    "TypePolicies",
    "balance",
    "lifespan_of",
    "most_expanded",
    "train_dictionary",
    "with_first",
]
