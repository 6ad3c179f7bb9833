"""How long a message is worth sending, and where that is set."""

from math import inf
from typing import NamedTuple

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue.policy import TopicPolicy
from sdrlinkd.link.schedule import ClassesParams


class Lifespan(NamedTuple):
    """A lifespan in seconds, and where it is set: topic | class; empty: no limit."""

    seconds: float
    source: str


def lifespan_of(policy: TopicPolicy, qos: Qos, classes: ClassesParams) -> Lifespan:
    """The lifespan of a message of class `qos` that has none of its own.

    The topic's lifespan takes precedence over that of the class. The class's does not apply to
    latched messages, which late joiners need at any age.
    """
    if policy.lifespan_s is not None:
        found = Lifespan(policy.lifespan_s, "topic")
    elif policy.durability == "transient_local":
        found = Lifespan(inf, "")
    else:
        found = Lifespan(classes.of(qos).lifespan_s, "class")
    return found if found.seconds < inf else Lifespan(inf, "")
