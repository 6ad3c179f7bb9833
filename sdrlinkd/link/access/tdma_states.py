"""The states of a robot's tdma schedule, and the events that change them.

No robot is configured as the master, so any robot may be absent. The schedule is that of the lowest
robot known, the root. Each robot can apply this rule by itself, and it has one answer once all
robots know of each other. A new robot listens first, so that it does not start a second schedule
beside one that it has not heard yet; the lowest robot waits least. A silent root is followed for
FORGET_S, as the loss of a second of beacons must not split the team. After that, each robot
continues by its own clock, which still nearly agrees, and the lowest robot becomes the root again.

::

                 BEGINS, ADOPTS             FOLLOWS
    LISTENING ──────────────────▶ ROOT ◀──────────────▶ FOLLOWER ─┐ FOLLOWS
        │                         │  ▲ ADOPTS    LOSES     ▲  ▲   │
        │                         └──┘                     │  └───┘
        └──────────────────────────────────────────────────┘
                               FOLLOWS

`grant` has the same states. There, ENDS leads back to LISTENING from everywhere.
"""

from collections.abc import Mapping
from enum import Enum, auto


class State(Enum):
    """State of a robot's schedule."""

    LISTENING = auto()
    """The robot keeps no schedule yet."""
    ROOT = auto()
    """The robot keeps its own schedule."""
    FOLLOWER = auto()
    """The robot keeps the schedule of a lower robot."""


class Happens(Enum):
    """Events that change the schedule's state."""

    BEGINS = auto()
    """The robot has listened for long enough and heard no schedule."""
    ADOPTS = auto()
    """The robot keeps its own schedule in the phase of another, whose robots will follow it."""
    FOLLOWS = auto()
    """The robot hears of a lower root, or of its root over fewer hops."""
    ENDS = auto()
    """The team goes on without a schedule."""
    LOSES = auto()
    """The robot has had no news of its root for FORGET_S."""


STEPS: Mapping[tuple[State, Happens], State] = {
    (State.LISTENING, Happens.BEGINS): State.ROOT,
    (State.LISTENING, Happens.ADOPTS): State.ROOT,
    (State.LISTENING, Happens.FOLLOWS): State.FOLLOWER,
    (State.ROOT, Happens.ADOPTS): State.ROOT,
    (State.ROOT, Happens.FOLLOWS): State.FOLLOWER,
    (State.FOLLOWER, Happens.FOLLOWS): State.FOLLOWER,
    (State.FOLLOWER, Happens.LOSES): State.ROOT,
}

GRANT_STEPS: Mapping[tuple[State, Happens], State] = {
    **STEPS,
    **{(state, Happens.ENDS): State.LISTENING for state in State},
}
