"""The one interface of all access policies."""

import math
from math import inf
from typing import NamedTuple, Protocol, Self

from sdrlinkd.link.access.sightings import Sightings
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.traits import Sensed
from sdrlinkd.wire import Frame

NEVER = -1.0
MOST_ON_THEIR_WAY = 8


class Slot(NamedTuple):
    """A burst may leave at `start` and must be over at `end`.

    Where it comes too late for `start`, it may still leave if it is over at `late_end`. Behind its
    first PDU, it holds none of a class less urgent than `least`.
    """

    start: float
    end: float = inf
    late_end: float = inf
    least: Qos = Qos.BULK

    @classmethod
    def exact(cls, start: float, end: float = inf, least: Qos = Qos.BULK) -> Self:
        """A slot whose burst leaves at `start` or not at all."""
        return cls(start, end, start, least)


class Wish(NamedTuple):
    """A burst of class `qos` that takes `need_s` or more wants to leave at `earliest` or later."""

    earliest: float
    qos: Qos
    need_s: float
    sensed: Sensed


class Access(Protocol):
    """Says when; a state machine over the link's clock, asked again with every block received."""

    @property
    def state(self) -> str:
        """For people: what it is doing and with which times."""

    @property
    def round_s(self) -> float:
        """So long at most until everybody had a turn; 0 where there are no turns."""

    @property
    def pause_s(self) -> float:
        """The channel stays idle for so long at least after each burst."""

    @property
    def share(self) -> float:
        """Of the air, what one robot has when all want to send, were it not for their bursts."""

    @property
    def step_s(self) -> float:
        """In a turn that was not used from its begin, bursts begin so far apart; 0: anywhere."""

    @property
    def others_follow(self) -> bool:
        """Whether the air that we leave free can be another's."""

    @property
    def keeps_schedule(self) -> bool:
        """Whether it ever tells others of a schedule."""

    def mean_wait_s(self, qos: Qos) -> float:
        """From when the channel falls idle to a burst of that class, on average."""

    def carries(self, burst_s: float) -> float:
        """Share of the air that bursts of that length take, of all robots together, when each
        always has one more to send: of class default, and whole.
        """

    def slot(self, wish: Wish) -> Slot | None:
        """Where it may leave; None: not now."""

    def sent(self, end: float, src: int | None) -> None:
        """A burst of ours will be on the air until `end`; `src`: whose PDUs it forwards, if any."""

    def not_sent(self, start: float) -> None:
        """The burst that was to begin at `start` did not leave."""

    def heard(self, src: int, at: float, is_relayed: bool) -> None:
        """A PDU of `src` came in a burst whose preamble was at `at`, perhaps from a relay."""

    def told_of(self, node: int, at: float) -> None:
        """At `at` another robot told that it hears `node`."""

    def beacon(self, src: int, at: float) -> None:
        """A beacon of `src` came at `at`, from itself."""

    def frame(self, start: float) -> Frame | None:
        """What to tell others of the schedule in a burst that leaves at `start`."""

    def take_frame(self, src: int, frame: Frame, at: float) -> None:
        """What `src` tells of the schedule, in a burst whose preamble was at `at`."""

    def notices(self, now: float) -> list[str]:
        """What a person should know of how the air is shared, in sentences."""


class BusyChannel:
    """What policies have in common: when the channel was busy last, by others or by us.

    As it stands: no turns, no pauses, nobody in our way, no schedule.
    """

    round_s = 0.0
    pause_s = 0.0
    share = 1.0
    step_s = 0.0
    others_follow = False
    keeps_schedule = False

    def __init__(self) -> None:
        self._own_ends = [NEVER]
        """Of the last bursts, ascending: some may be on their way to the radio still."""
        self._scheduled = Sightings()
        """Who takes turns by a schedule."""

    def mean_wait_s(self, qos: Qos) -> float:  # noqa: ARG002  # not all ask for it
        """From when the channel falls idle to a burst of that class, on average: none."""
        return 0.0

    def sent(self, end: float, src: int | None) -> None:  # noqa: ARG002  # not all ask for it
        """Remember a burst of ours that will be on the air until `end`."""
        self._own_ends = [*self._own_ends[-MOST_ON_THEIR_WAY:], end]

    def not_sent(self, start: float) -> None:
        """Forget the burst that was to begin at `start`: it did not leave."""
        for end in self._own_ends:
            if end > start:
                self._own_ends.remove(end)
                break
        if not self._own_ends:
            self._own_ends = [NEVER]

    def heard(self, src: int, at: float, is_relayed: bool) -> None:
        """Ignore whose burst was heard: no turn depends on it."""

    def told_of(self, node: int, at: float) -> None:
        """Ignore who hears whom: no turn depends on it."""

    def beacon(self, src: int, at: float) -> None:
        """Ignore who is there: no turn depends on it."""

    def frame(self, start: float) -> Frame | None:
        """The schedule to tell others of: none is kept."""

    def take_frame(self, src: int, frame: Frame, at: float) -> None:  # noqa: ARG002  # not all ask
        """Remember that robot `src` keeps a schedule, and so has another policy."""
        self._scheduled.add(src, at)

    def notices(self, now: float) -> list[str]:
        """Who shares the air in another way."""
        return [
            f"robot {src} keeps a tdma schedule and this robot does not: their bursts collide; "
            "give both the same [access], and radios of one kind where access.policy is auto"
            for src in self._scheduled.lately(now)
        ]

    @property
    def own_end(self) -> float:
        """When our own last burst ends."""
        return self._own_ends[-1]

    def idle_since(self, sensed: Sensed) -> float | None:
        """Since when the channel is idle; None while it is busy."""
        end = max(sensed.idle_since, self.own_end)
        return end if end <= sensed.until else None


def next_on_grid(origin: float, period: float, earliest: float) -> float:
    """The first of `origin`, `origin + period`, … that is not before `earliest`."""
    steps = max(0, math.ceil((earliest - origin) / period - 1e-6))
    return origin + steps * period
