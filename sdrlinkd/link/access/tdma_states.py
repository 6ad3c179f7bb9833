"""Whose schedule a robot keeps in tdma, and what changes that.

Nobody is the master by configuration, so any robot may be missing. The schedule is that of the
lowest robot heard of, its root: a rule that all can apply alone, and that has one answer once all
have heard of each other. A robot that comes first listens, so as not to begin a second schedule
beside one that it has not heard yet; who is lowest waits least. A root that falls silent is
followed for FORGET_S, for losing a second of beacons must not break the team apart; then everybody
goes on by its own clock, which is still nearly the old one, and the lowest wins again.

::

                 BEGINS, ADOPTS             FOLLOWS
    LISTENING ──────────────────▶ ROOT ◀──────────────▶ FOLLOWER ─┐ FOLLOWS
        │                         │  ▲ ADOPTS    LOSES     ▲  ▲   │
        │                         └──┘                     │  └───┘
        └──────────────────────────────────────────────────┘
                               FOLLOWS
"""

from collections.abc import Mapping
from enum import Enum, auto


class State(Enum):
    """Whose schedule a robot keeps."""

    LISTENING = auto()
    """None yet."""
    ROOT = auto()
    """Its own."""
    FOLLOWER = auto()
    """That of a lower robot."""


class Happens(Enum):
    """What changes whose schedule it keeps."""

    BEGINS = auto()
    """It has listened for long enough, and heard none."""
    ADOPTS = auto()
    """It keeps its own schedule at the place of another, whose robots will follow it."""
    FOLLOWS = auto()
    """It hears of a lower root, or of its own by fewer hops."""
    LOSES = auto()
    """Nothing was heard of its root for FORGET_S."""


STEPS: Mapping[tuple[State, Happens], State] = {
    (State.LISTENING, Happens.BEGINS): State.ROOT,
    (State.LISTENING, Happens.ADOPTS): State.ROOT,
    (State.LISTENING, Happens.FOLLOWS): State.FOLLOWER,
    (State.ROOT, Happens.ADOPTS): State.ROOT,
    (State.ROOT, Happens.FOLLOWS): State.FOLLOWER,
    (State.FOLLOWER, Happens.FOLLOWS): State.FOLLOWER,
    (State.FOLLOWER, Happens.LOSES): State.ROOT,
}
