"""Shares the airtime of one class and priority fairly among its topics.

This is start-time fair queueing (Goyal, Vin and Cheng, 1996), with a head start as in fq_codel for
a topic that had nothing to send. Each topic has an account of the octets that it has sent, divided
by its weight, and the lowest account is served first. So topics that always have something to send
get airtime in proportion to their weights, whatever sizes and rates they offer. A topic that asks
for less than its share finds its account below all others: it waits for the burst on the air, and
for the head starts of others that begin at the same time.

An account says nothing about times at which its topic did not compete. When a topic comes back, its
account is set to that of the topic served last, less HEAD_START PDUs. When all have been served,
the accounts are forgotten.
"""

from bisect import bisect_left, insort
from collections.abc import Sequence

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue.message import Account, Lane, Outgoing

HEAD_START = 2
"""PDUs that a topic without anything to send may save up."""
MOST_IDLE = 1024
"""Most accounts that are kept for topics without anything to send."""


class Level:
    """The lanes of one class and priority that are not empty, in service order.

    The lowest account comes first; among equal ones, the message that expires first; among equal
    ones of these, the lane that was served longest ago.
    """

    __slots__ = ("_accounts", "_head_start", "_now", "_turn", "key", "lanes", "per_dst", "qos")

    def __init__(self, key: tuple[int, int], pdu_size: int) -> None:
        self.key = key
        self.qos = Qos(key[0])
        self.lanes: list[Lane] = []
        self.per_dst: dict[int, int] = {}
        self._head_start = HEAD_START * pdu_size
        self._accounts: dict[int, Account] = {}
        self._now = 0.0
        """The highest account of a topic whose turn it was, when it was served."""
        self._turn = 0

    def lane(self, topic_id: int, dst: int) -> Lane:
        """A new lane, to be added when it has a message."""
        account = self._accounts.get(topic_id)
        if account is None:
            account = self._accounts[topic_id] = Account(topic_id)
        return Lane(account, dst, self.key)

    def add(self, lane: Lane, head: Outgoing) -> None:
        """Add a lane whose first message is `head`."""
        account = lane.account
        if not account.lanes:
            account.pay()
            account.catch_up(self._now - self._head_start / account.weight)
        account.lanes.append(lane)
        self._place(lane, head)
        self.per_dst[lane.dst] = self.per_dst.get(lane.dst, 0) + 1

    def remove(self, lane: Lane) -> None:
        """Remove a lane that has become empty."""
        self._displace(lane)
        self.per_dst[lane.dst] -= 1
        if not self.per_dst[lane.dst]:
            del self.per_dst[lane.dst]
        lane.account.lanes.remove(lane)
        if len(self._accounts) > MOST_IDLE + len(self.lanes):
            idle = (each for each in self._accounts.values() if not each.lanes)
            del self._accounts[min(idle, key=lambda each: each.spent).topic_id]

    def charge(self, account: Account, octets: float, *, fills: bool = False) -> None:
        """Charge a topic for octets that it sent, and move its lanes back accordingly.

        `fills`: it was not its turn, but nobody before it could use the room. That counts, but runs
        up no debt: otherwise the topic would wait for as long when there is no such room any more.
        """
        if not fills:
            self._now = max(self._now, account.spent)
        account.pay(octets)
        if fills:
            account.forgive(self._now + 2 * self._head_start / account.weight)
        for lane in account.lanes:
            self.move(lane)
        # A topic that could not be served has saved up no more than one that had nothing to send.
        while self.lanes and (first := self.lanes[0].account).spent < (
            least := self._now - 2 * self._head_start / first.weight
        ):
            first.catch_up(least)
            for lane in tuple(first.lanes):
                self.move(lane)

    def move(self, lane: Lane) -> None:
        """Put a lane in its place by what its account and its first message are now."""
        head = lane.head
        if head is None:
            return
        if len(self.lanes) == 1:
            lane.order = self._rank(lane, head)
            return
        self._displace(lane)
        self._place(lane, head)

    def _rank(self, lane: Lane, head: Outgoing) -> tuple[float, float, int]:
        self._turn += 1
        return lane.account.spent, head.expires_at, self._turn

    def _place(self, lane: Lane, head: Outgoing) -> None:
        lane.order = self._rank(lane, head)
        insort(self.lanes, lane, key=_order)

    def _displace(self, lane: Lane) -> None:
        alone = len(self.lanes) == 1
        del self.lanes[0 if alone else bisect_left(self.lanes, lane.order, key=_order)]


def _order(lane: Lane) -> tuple[float, float, int]:
    return lane.order


def with_first(levels: Sequence[Level], first: Qos) -> list[Level]:
    """The levels in service order, except that those of class `first` come first."""
    return sorted(levels, key=lambda level: (level.qos is not first, level.key))
