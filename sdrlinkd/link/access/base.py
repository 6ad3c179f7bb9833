"""The common interface of all access policies."""

import math
from math import inf
from typing import NamedTuple, Protocol, Self

from sdrlinkd.link.access.by_auction import ByAuction
from sdrlinkd.link.access.by_request import ByRequest
from sdrlinkd.link.access.requests import Due, Waiting
from sdrlinkd.link.access.sightings import Sightings
from sdrlinkd.link.paths import Edges
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.traits import Sensed
from sdrlinkd.wire import Frame, Grant, Want

NEVER = -1.0
MOST_ON_THEIR_WAY = 8


class Slot(NamedTuple):
    """A time slot: a burst may leave at `start` and must be over at `end`.

    A burst that misses `start` may still leave if it is over at `late_end`. After its first PDU,
    the burst holds no PDU of a class less urgent than `least`. `is_pulse`: instead of a burst, a
    pulse of energy leaves.
    """

    start: float
    end: float = inf
    late_end: float = inf
    least: Qos = Qos.BULK
    is_pulse: bool = False

    @classmethod
    def exact(cls, start: float, end: float = inf, least: Qos = Qos.BULK) -> Self:
        """A slot whose burst leaves at `start` or not at all."""
        return cls(start, end, start, least)


class Wish(NamedTuple):
    """A request to send a burst of class `qos`, at least `need_s` long, at `earliest` or later.

    Where turns are given by request, `waiting` is all that waits, and `dues` are the next messages
    that the team expects, for the robot that plans. `then_s` is the airtime of another burst that
    should follow in the same turn. In an auction, `waiting` has the priority.
    """

    earliest: float
    qos: Qos
    need_s: float
    sensed: Sensed
    waiting: Waiting | None = None
    dues: tuple[Due, ...] = ()
    then_s: float = 0.0


class Access(Protocol):
    """An access policy: it decides when to send.

    It is a state machine over the link's clock, and is queried again with every received block.
    """

    @property
    def state(self) -> str:
        """The policy's state and times, as text for people."""

    @property
    def lacks(self) -> str:
        """What this robot has to hear before it knows its turns again, in words; empty: nothing.

        `state` says it, too. Meanwhile, no bound of the time until a turn holds.
        """

    @property
    def round_s(self) -> float:
        """Longest time in s until every robot has had a turn; 0 if there are no turns."""

    @property
    def pause_s(self) -> float:
        """Shortest idle time of the channel after each burst, in s."""

    @property
    def share(self) -> float:
        """Share of airtime in which one robot may start bursts, not counting others' bursts: its
        slots in tdma, else 1.
        """

    @property
    def step_s(self) -> float:
        """Grid in s of burst starts in a turn that is not used from its start; 0: no grid."""

    @property
    def others_follow(self) -> bool:
        """Whether other robots may use the airtime that we leave free."""

    @property
    def keeps_schedule(self) -> bool:
        """Whether the policy announces a schedule to other robots."""

    @property
    def own_end(self) -> float:
        """Time when our own last burst ends."""

    @property
    def least_room(self) -> int:
        """Octets for records that a PDU must have; 0 if the policy tells none."""

    @property
    def needs_links(self) -> bool:
        """Whether the policy has to know who hears whom, so that LSAs must tell it."""

    @property
    def tells_at(self) -> float:
        """Time in s from which the policy itself has something to tell; infinity: nothing."""

    @property
    def by_request(self) -> ByRequest | None:
        """The policy itself, if it gives turns by request."""

    @property
    def by_auction(self) -> ByAuction | None:
        """The policy itself, if each burst tells what its robot wants next."""

    def mean_wait_s(self, qos: Qos) -> float:
        """Mean time in s from an idle channel to a burst of class `qos`."""

    def carries(self, burst_s: float) -> float:
        """Share of airtime that bursts of length `burst_s` take, all robots together, under full
        load: every robot always has another complete burst of class default to send.
        """

    def slot(self, wish: Wish) -> Slot | None:
        """The slot in which the requested burst may leave; None: not now."""

    def sent(self, end: float, src: int | None) -> None:
        """Note that our burst will be on the air until `end`.

        `src` is the robot whose PDUs the burst relays; None: our own.
        """

    def not_sent(self, start: float) -> None:
        """Note that the burst planned for `start` did not leave."""

    def heard(self, src: int, at: float, is_relayed: bool, *, is_weak: bool = False) -> None:
        """Note a PDU of robot `src`, in a burst whose preamble was at `at`, possibly relayed.

        `is_weak`: most PDUs get lost with such a signal, so this one came by luck.
        """

    def told_of(self, node: int, at: float, by: int, *, is_weak: bool = False) -> None:
        """Note that robot `by` reported at `at` that it hears robot `node`."""

    def beacon(self, src: int, at: float) -> None:
        """Note a beacon that came at `at` directly from robot `src`."""

    def take_want(self, src: int, want: Want, at: float) -> None:
        """Take what a robot wants next, as robot `src` told it in a burst at `at`."""

    def take_grant(self, src: int, grant: Grant, at: float, *, is_weak: bool = False) -> None:
        """Take the turns that robot `src` told, after a FRAME, in a burst at `at`."""

    def know_links(self, edges: Edges) -> None:
        """Take the links of the team, as its LSAs tell them."""

    def frame(self, start: float) -> Frame | None:
        """The schedule to announce in a burst that leaves at `start`; None: none is kept."""

    def take_frame(self, src: int, frame: Frame, at: float) -> None:
        """Take the schedule that robot `src` announced in a burst whose preamble was at `at`."""

    def notices(self, now: float) -> list[str]:
        """What a person should know about the sharing of the channel, in sentences."""


class BusyChannel:
    """The base of all policies, which knows when the channel was last busy, by others or by us.

    Its defaults are those of a policy without turns, pauses and schedule.
    """

    lacks = ""
    round_s = 0.0
    pause_s = 0.0
    share = 1.0
    step_s = 0.0
    others_follow = False
    keeps_schedule = False
    least_room = 0
    needs_links = False

    tells_at = inf
    by_request: ByRequest | None = None
    by_auction: ByAuction | None = None

    def __init__(self) -> None:
        self._own_ends = [NEVER]
        """Ends of our last bursts, ascending; some may not have left yet."""
        self._scheduled = Sightings()
        """Robots that announce a schedule."""
        self._bidding = Sightings()
        """Robots that take part in an auction."""

    def mean_wait_s(self, qos: Qos) -> float:
        """Mean time in s from an idle channel to a burst of class `qos`: 0."""
        return 0.0

    def sent(self, end: float, src: int | None) -> None:
        """Remember a burst of ours that will be on the air until `end`."""
        self._own_ends = [*self._own_ends[-MOST_ON_THEIR_WAY:], end]

    def not_sent(self, start: float) -> None:
        """Forget the burst planned for `start`, which did not leave."""
        for end in self._own_ends:
            if end > start:
                self._own_ends.remove(end)
                break
        if not self._own_ends:
            self._own_ends = [NEVER]

    def heard(self, src: int, at: float, is_relayed: bool, *, is_weak: bool = False) -> None:
        """Ignore the source of a burst, as no turn depends on it."""

    def told_of(self, node: int, at: float, by: int, *, is_weak: bool = False) -> None:
        """Ignore which robots others hear, as no turn depends on it."""

    def beacon(self, src: int, at: float) -> None:
        """Ignore beacons, as no turn depends on them."""

    def take_want(self, src: int, want: Want, at: float) -> None:
        """Remember that robot `src` tells what it wants and so uses another policy."""
        self._bidding.add(src, at)

    def take_grant(self, src: int, grant: Grant, at: float, *, is_weak: bool = False) -> None:
        """Ignore turns; the FRAME before them tells that the other policy is another one."""

    def know_links(self, edges: Edges) -> None:
        """Ignore the links of the team, as no turn depends on them."""

    def frame(self, start: float) -> Frame | None:
        """The schedule to announce: None, as no schedule is kept."""

    def take_frame(self, src: int, frame: Frame, at: float) -> None:
        """Remember that robot `src` keeps a schedule and so uses another policy."""
        self._scheduled.add(src, at)

    def notices(self, now: float) -> list[str]:
        """Sentences on robots that use another access policy."""
        others = {
            "keeps a schedule": self._scheduled.lately(now),
            "takes part in an auction": self._bidding.lately(now),
        }
        return [
            f"robot {src} {what} and this robot does not: their bursts collide; give both the same "
            "[access], and radios of one kind where access.policy is auto"
            for what, robots in others.items()
            for src in robots
        ]

    @property
    def own_end(self) -> float:
        """Time when our own last burst ends."""
        return self._own_ends[-1]

    def idle_since(self, sensed: Sensed) -> float | None:
        """Time since which the channel has been idle; None while it is busy."""
        end = max(sensed.idle_since, self.own_end)
        return end if end <= sensed.until else None


def next_on_grid(origin: float, period: float, earliest: float) -> float:
    """The first of `origin`, `origin + period`, … that is not before `earliest`."""
    steps = max(0, math.ceil((earliest - origin) / period - 1e-6))
    return origin + steps * period
