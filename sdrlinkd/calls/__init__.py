"""Service calls over a lossy radio, executed at most once: both halves, their packets, and offers.

A request is repeated until its answer, or word that it was taken, comes. The answer is repeated
until it is acknowledged. A request has a number and the boot number of its bridge, by which the
other half recognises repeats: it answers them again, but never executes one twice.
"""

from sdrlinkd.calls.answerer import KEPT_S, Answerer, Key
from sdrlinkd.calls.asker import Asker, Ended
from sdrlinkd.calls.offered import (
    ACTION,
    CALL_TYPE,
    CALLS,
    DIRECTORY,
    FEEDBACK,
    INNER,
    MOST_NAME,
    MOST_TOLD,
    SEND_GOAL,
    STATUS,
    STATUS_TYPE,
    TEXT,
    OfAction,
    Service,
    calls_name,
    feedback_type,
    of_action,
    told,
    understood,
    with_action,
)
from sdrlinkd.calls.packet import (
    CANCEL_GOAL,
    ENCAPSULATION,
    GET_RESULT,
    MOST_KEPT,
    WORDS,
    Kind,
    Packet,
    Status,
)
from sdrlinkd.calls.repeats import MOST_TRIES, RESULT_KEPT_S, Sent

__all__ = [
    "ACTION",
    "CALLS",
    "CALL_TYPE",
    "CANCEL_GOAL",
    "DIRECTORY",
    "ENCAPSULATION",
    "FEEDBACK",
    "GET_RESULT",
    "INNER",
    "KEPT_S",
    "MOST_KEPT",
    "MOST_NAME",
    "MOST_TOLD",
    "MOST_TRIES",
    "RESULT_KEPT_S",
    "SEND_GOAL",
    "STATUS",
    "STATUS_TYPE",
    "TEXT",
    "WORDS",
    "Answerer",
    "Asker",
    "Ended",
    "Key",
    "Kind",
    "OfAction",
    "Packet",
    "Sent",
    "Service",
    "Status",
    "calls_name",
    "feedback_type",
    "of_action",
    "told",
    "understood",
    "with_action",
]
