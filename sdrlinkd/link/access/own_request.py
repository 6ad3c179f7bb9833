"""What the root knows of what waits at one robot, and when it must be told more."""

from math import inf

from sdrlinkd.link.access.requests import Waiting, waiting_of, want_of
from sdrlinkd.link.access.round_plan import Times
from sdrlinkd.link.access.turns import Round
from sdrlinkd.wire import Want

AGAIN_ROUNDS = 3
"""Rounds without a longer turn after which a robot tells again what it wants."""
LONGER = 1.5
"""Turns of more than so many least turns were given for a request."""


class OwnRequest:
    """The last request of robot `own_id`, less the turns that were given since."""

    def __init__(self, own_id: int, times: Times, round_s: float) -> None:
        self._own_id = own_id
        self._times = times
        self._round_s = round_s
        self._known: Waiting | None = None
        self._heeded_at = -inf
        """When we last asked, or had a longer turn."""

    def of(self, left: Waiting, now: float) -> Want | None:
        """What to tell while `left` waits; None: the root knows enough."""
        known = self._known
        if known is not None and (left.qos, -left.priority) >= (known.qos, -known.priority):
            enough_s = min(left.all_s, self._times.budget_s)
            is_heeded = now <= self._heeded_at + AGAIN_ROUNDS * self._round_s
            if known.all_s >= enough_s / 2 and is_heeded:
                return None
        return want_of(self._own_id, left)

    def told(self, want: Want, now: float) -> None:
        """Note what was told."""
        self._known, self._heeded_at = waiting_of(want), now

    def given(self, found: Round) -> None:
        """Note the turns of a new round."""
        for turn in found.of(self._own_id):
            length_s = turn.end - turn.begin
            if length_s > LONGER * self._times.turn_s:
                self._heeded_at = turn.end
            if self._known is not None:
                self._known = self._known.without(length_s)

    def forget(self) -> None:
        """Begin anew with another root."""
        self._known = None
