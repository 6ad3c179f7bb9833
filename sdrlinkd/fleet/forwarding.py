"""Which messages of a robot a gateway puts on Zenoh, and when (fleet document, section 3)."""

from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass
from enum import Enum
from typing import Generic, TypeVar

from sdrlinkd.client import MessageName
from sdrlinkd.fleet.names import Key, NamedRecently

FIRST_HOLD_S = 0.02
LEAST_HOLD_S = 0.002
MOST_HOLD_S = 0.5
LEAST_MARGIN_S = 0.001
MOST_MARGIN = 0.5
"""Of what nearly all of the leader's puts took."""
NEARLY_ALL = 0.95
REMEMBERED = 64
"""The leader's last puts of which the delay is remembered."""

T = TypeVar("T")


class Turn(Enum):
    """Whose turn it is to put a message that has come from the radio."""

    OURS = "this gateway puts it now"
    LATER = "it is held, and put if nobody else does"
    OTHERS = "another gateway puts it, or has put it"
    PAST = "it came before"


@dataclass(slots=True)
class _Known(Generic[T]):
    """A message of which something is known: that we heard it, or that another put it."""

    heard_at: float | None = None
    passed_at: float | None = None
    """When another gateway's put came."""
    is_led: bool = False
    """Whether that was the leader's."""
    is_put: bool = False
    item: T | None = None
    """What is held of it."""


class Forwarding(Generic[T]):
    """A gateway's messages of one robot; items of any type, times in s.

    The gateway that leads puts at once; the others hold their copy.
    """

    def __init__(self) -> None:
        self._known: NamedRecently[_Known[T]] = NamedRecently()
        self._held: deque[tuple[float, _Known[T]]] = deque()
        self._delays: deque[float] = deque(maxlen=REMEMBERED)
        self._usual_s = FIRST_HOLD_S / 2
        """What nearly all of the leader's last puts took."""
        self.hold_s = FIRST_HOLD_S
        self.rank = 0
        """Gateways besides the leader that put before this one what the leader missed."""
        self.put_for_others = 0
        """Messages that the leader did not put in time, and this gateway did."""
        self.put_twice = 0
        """Messages that the leader put after all."""

    def heard(
        self, key: Hashable, name: MessageName | None, item: T, now: float, *, leads: bool
    ) -> Turn:
        """Take a message from the radio."""
        if name is None:
            # Each daemon makes a stop message of its own.
            return Turn.OURS if leads else Turn.OTHERS
        at: Key = (key,)
        known = self._known.find(at, name, now)
        if known is None:
            known = _Known(heard_at=now)
            self._known.add(at, name, known, now)
        elif known.heard_at is not None:
            return Turn.PAST
        else:
            known.heard_at = now
            if known.passed_at is not None:
                if known.is_led:
                    self._learn(now, known.passed_at)
                return Turn.OTHERS
        if leads:
            known.is_put = True
            return Turn.OURS
        known.item = item
        # Whoever goes before this one has waited, and its put takes as long as the leader's.
        self._held.append((now + self.hold_s + self.rank * self._usual_s, known))
        return Turn.LATER

    def is_known(self, key: Hashable, name: MessageName, now: float) -> bool:
        """Whether a message was heard or passed lately."""
        return self._known.find((key,), name, now) is not None

    def passed(
        self, key: Hashable, name: MessageName | None, now: float, *, by_leader: bool
    ) -> bool:
        """Note that another gateway has put a message; True if the copy held here is dropped.

        Delays are learnt from the leader alone: the others have waited for it.
        """
        if name is None:
            return False
        at: Key = (key,)
        known = self._known.find(at, name, now)
        if known is None:
            self._known.add(at, name, _Known(passed_at=now, is_led=by_leader), now)
            return False
        if known.passed_at is not None:
            return False
        known.passed_at = now
        if known.heard_at is None:
            return False
        if by_leader:
            self._learn(known.heard_at, now)
        if known.is_put:
            self.put_twice += 1
            if by_leader:
                self.hold_s = min(MOST_HOLD_S, 2 * self.hold_s)
        was_held, known.item = known.item is not None, None
        return was_held

    @property
    def due_at(self) -> float:
        """When `due` has something next, in s."""
        self._skip()
        return self._held[0][0] if self._held else float("inf")

    def due(self, now: float) -> list[T]:
        """The copies that have been held for long enough."""
        found = []
        while self._held and self._held[0][0] <= now:
            _, known = self._held.popleft()
            if known.item is not None:
                found.append(known.item)
                known.item, known.is_put = None, True
                self.put_for_others += 1
        return found

    def lead(self) -> list[T]:
        """All copies that are held, as this gateway leads from now on."""
        return self.due(float("inf"))

    def _skip(self) -> None:
        while self._held and self._held[0][1].item is None:
            self._held.popleft()

    def _learn(self, heard_at: float, passed_at: float) -> None:
        """Learn how much later than we hear a message the leader's put of it arrives."""
        self._delays.append(max(0.0, passed_at - heard_at))
        ordered = sorted(self._delays)
        usual_s = self._usual_s = ordered[int(NEARLY_ALL * (len(ordered) - 1))]
        # Over a steady network, however slow, a put that is later than these is rare.
        spread_s = usual_s - ordered[len(ordered) // 2]
        margin_s = min(MOST_MARGIN * usual_s, max(LEAST_MARGIN_S, spread_s))
        self.hold_s = min(MOST_HOLD_S, max(LEAST_HOLD_S, usual_s + margin_s))
