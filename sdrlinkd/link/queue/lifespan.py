"""How long a message is worth sending, and who says so."""

from math import inf
from typing import NamedTuple

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue.policy import TopicPolicy
from sdrlinkd.link.schedule import ClassesParams


class Lifespan(NamedTuple):
    """`seconds` after it is made; `source`: topic | class, empty where it has no end."""

    seconds: float
    source: str


def lifespan_of(policy: TopicPolicy, qos: Qos, classes: ClassesParams) -> Lifespan:
    """Of a message of class `qos` that names none itself.

    The topic's own goes before that of the class. What is kept for robots that come late is worth
    something however old it is, so the class says nothing of it.
    """
    if policy.lifespan_s is not None:
        found = Lifespan(policy.lifespan_s, "topic")
    elif policy.durability == "transient_local":
        found = Lifespan(inf, "")
    else:
        found = Lifespan(classes.of(qos).lifespan_s, "class")
    return found if found.seconds < inf else Lifespan(inf, "")
