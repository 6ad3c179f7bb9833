"""What goes from one source to one destination through this robot, and who has to answer for it."""

from collections import deque
from math import inf
from typing import NamedTuple

from sdrlinkd.wire import heard_number

ANSWER_S = 0.1
"""Time in s after which an answer gets a PDU of its own."""
LEAST_WAIT_S, MOST_WAIT_S = 0.15, 1.0
"""Limits of the time in s for which an answer is awaited."""
MEAN_WEIGHT = 0.125
DEVIATION_WEIGHT = 0.25
DEVIATIONS = 4
"""The wait is the mean time of an answer and so many mean deviations, as TCP has it."""
UNANSWERED = 3
"""PDUs without an answer after which the route goes around."""
MOST_DOUBTS = 6
"""How often in a row a ROUTE is told again as somebody may not know it."""
MOST_KEPT = 256
ACTIVE_S = 2.0
"""Time in s without a PDU after which a flow has ended."""


class _Sent(NamedTuple):
    """A PDU that was sent at `first_at`, and last at `at`."""

    number: int
    first_at: float
    at: float
    times: int


class Flow:
    """The PDUs of one source to one destination that this robot sends or forwards.

    `hops` are the robots that have to answer: those that forward next, or the destination.
    `number` is that of the first PDU.
    """

    def __init__(self, src: int, dst: int, number: int) -> None:
        self.src, self.dst = src, dst
        self.robots: frozenset[int] = frozenset()
        """Who forwards next."""
        self.hops: frozenset[int] = frozenset()
        self.tellers: frozenset[int] = frozenset()
        """Who names us to forward it."""
        self.sent_at = -inf
        self.told_at = -inf
        """When ROUTE was made last."""
        self.is_news = False
        """Whether others are named than before."""
        self.doubts = 0
        """How often in a row ROUTE was told again as somebody may not know it."""
        self._unsure: frozenset[int] = frozenset()
        """The robots of which it is not known whether they know that they are named."""
        self.first = 0
        """The number of the first PDU that those named are to forward."""
        self.hops_left = 0
        """Hops that were left in the last PDU."""
        self.went_around = 0
        """How often the route has gone around a robot that did not answer."""
        self._newest = number
        self._sent: deque[_Sent] = deque(maxlen=MOST_KEPT)
        """The PDUs that await an answer."""
        self._answered: dict[int, int] = {}
        """The number that each robot has heard up to."""
        self._wait_s: dict[int, tuple[float, float]] = {}
        """(mean, mean deviation) of the time of an answer, by robot."""

    def sent(self, number: int, hops_left: int, at: float, *, is_bare: bool = False) -> None:
        """Note that a PDU has left; again, if it was repeated. Nobody answers for a bare one."""
        self.sent_at, self.hops_left = at, hops_left
        number = self._newest = heard_number(self._newest, number)
        if not self.hops or is_bare:
            return
        for i, known in enumerate(self._sent):
            if known.number == number:
                self._sent[i] = known._replace(at=at, times=known.times + 1)
                return
        self._sent.append(_Sent(number, at, at, 1))

    def name(self, robots: frozenset[int], hops: frozenset[int], now: float) -> bool:
        """Let others forward from now on; returns whether that is news."""
        is_news = robots != self.robots
        if is_news:
            open_ = [self.first_unanswered(hop) for hop in self.hops]
            self.first = min((each for each in open_ if each is not None), default=self._newest)
            self.is_news = True
            self.doubts = 0
            self._unsure = (self._unsure | robots - self.robots) & robots
        if hops != self.hops:
            # Those that are new have time from now on.
            self._sent = deque(
                (each._replace(first_at=now, at=now, times=1) for each in self._sent if hops),
                maxlen=MOST_KEPT,
            )
        self.robots, self.hops = robots, hops
        return is_news

    def heard(self, seq: int, hops_left: int, at: float) -> None:
        """Note that somebody has forwarded a PDU; with several to do so, nobody knows who."""
        if len(self.hops) != 1 or hops_left >= self.hops_left:
            return
        (hop,) = self.hops
        number = max((each.number for each in self._sent if each.number & 0xFF == seq), default=-1)
        if number >= 0:
            self.answered(hop, number + 1, at, is_named=True)

    def answered(self, hop: int, up_to: int, at: float, *, is_named: bool = False) -> bool:
        """Note that a robot has heard of all PDUs before `up_to`; False if it need not answer.

        `is_named`: it would not have answered without knowing that it is named.
        """
        if hop not in self.hops:
            return False
        if is_named:
            self._unsure -= {hop}
        up_to = heard_number(self._sent[-1].number + 1 if self._sent else up_to, up_to)
        before = self._answered.get(hop, -1)
        if up_to <= before:
            return True
        self._answered[hop] = up_to
        for each in self._sent:
            if before <= each.number < up_to and each.times == 1:
                self._note(hop, max(0.0, at - each.at))
                break
        least = min((self._answered.get(each, -1) for each in self.hops), default=inf)
        while self._sent and self._sent[0].number < least:
            self._sent.popleft()
        return True

    def unanswered(self, hop: int, now: float) -> tuple[list[int], int]:
        """(the PDUs that a robot should have answered since they were sent last, how often all that
        it should have answered were sent).
        """
        up_to, latest = self._answered.get(hop, -1), now - self.wait_s(hop)
        open_ = [each for each in self._sent if each.number >= up_to and each.first_at < latest]
        again = [each.number for each in open_ if each.at < latest]
        return again, sum(each.times for each in open_)

    def first_unanswered(self, hop: int) -> int | None:
        """The first number that a robot has not answered; None: it has answered all."""
        up_to = self._answered.get(hop, -1)
        return next((each.number for each in self._sent if each.number >= up_to), None)

    def forgive(self, hop: int) -> None:
        """Expect no answer any more to what a robot was sent so far."""
        if self._sent:
            up_to = max(each.number for each in self._sent) + 1
            self._answered[hop] = max(up_to, self._answered.get(hop, -1))

    def wait_s(self, hop: int) -> float:
        """How long an answer of a robot is awaited, in s."""
        mean_s, deviation_s = self._wait_s.get(hop, (ANSWER_S, 0.0))
        return min(max(mean_s + DEVIATIONS * deviation_s, LEAST_WAIT_S), MOST_WAIT_S)

    @property
    def is_doubtful(self) -> bool:
        """Whether those that forward next should hear of it again."""
        return bool(self._unsure) and self.doubts < MOST_DOUBTS

    def is_active(self, now: float) -> bool:
        """Whether PDUs were sent lately."""
        return now - self.sent_at < ACTIVE_S

    def _note(self, hop: int, answer_s: float) -> None:
        known = self._wait_s.get(hop)
        if known is None:
            self._wait_s[hop] = answer_s, answer_s / 2
            return
        mean_s, deviation_s = known
        deviation_s += DEVIATION_WEIGHT * (abs(answer_s - mean_s) - deviation_s)
        self._wait_s[hop] = mean_s + MEAN_WEIGHT * (answer_s - mean_s), deviation_s
