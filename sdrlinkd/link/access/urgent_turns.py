"""Notices who always asks for urgent turns, from the requests and plans that a robot hears."""

from math import inf

from sdrlinkd.link.access.always_urgent import STALE_S, AlwaysUrgent
from sdrlinkd.link.access.own_request import LONGER
from sdrlinkd.link.access.requests import Requests, Waiting, want_of
from sdrlinkd.link.access.round_plan import Times
from sdrlinkd.link.access.turns import Round
from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import Want


class UrgentTurns(AlwaysUrgent):
    """Which of `n` robots always ask for urgent turns. Air counts in s.

    The root tells no requests of its own, so only the root itself knows these.
    """

    def __init__(self, own_id: int, n: int, times: Times) -> None:
        super().__init__(own_id, n)
        self._times = times
        self._requests = Requests()
        self._known_at: dict[int, float] = {}
        """When each robot last asked, or got a longer turn."""
        self._last: Round | None = None

    def asks(self, want: Want, at: float) -> None:
        """Note a request."""
        self._requests.take(want, at)
        self._known_at[want.node] = at

    def waits(self, left: Waiting | None, at: float) -> None:
        """Note what is left here after a burst of ours, as the root."""
        nothing = Want(self._own_id, Qos.BULK, 0, 0, 0, 0)
        self.asks(nothing if left is None else want_of(self._own_id, left), at)

    def take(self, found: Round) -> None:
        """Note the turns of a new round."""
        urgent = {node for node in self._known_at if self._wants_urgent(node, found.begin)}
        if self._last is not None:
            self.passed(max(0.0, min(found.begin - self._last.begin, STALE_S)))
            root_s = found.begin - self._last.end - self._times.root_s + self._times.budget_s
            if self._own_id in urgent and root_s > 0:
                # The turn of the root is in no plan.
                self.had(self._own_id, root_s)
        self.look(urgent, found.begin)
        for turn in found.turns:
            length_s = turn.end - turn.begin
            if turn.node in urgent and length_s > LONGER * self._times.turn_s:
                self.had(turn.node, length_s - self._times.turn_s)
                self._known_at[turn.node] = turn.end
            self._requests.given(turn.node, length_s)
        self._last = found

    def _wants_urgent(self, node: int, now: float) -> bool:
        waiting = self._requests.of(node, now)
        is_known = now < self._known_at.get(node, -inf) + STALE_S
        return is_known and waiting is not None and waiting.qos is Qos.URGENT
