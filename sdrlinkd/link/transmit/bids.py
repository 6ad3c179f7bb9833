"""What a robot wants next, as each of its bursts tells it where the air goes by auction."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

from sdrlinkd.link.access import ByAuction, Waiting, want_of
from sdrlinkd.link.packing import BuiltPdu, Composer
from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Outbox
from sdrlinkd.link.schedule import Allowance
from sdrlinkd.wire import WANT_SIZE, Want, build_records

AirtimeOf = Callable[[int], float]
"""The airtime in s of a burst of so many PDUs."""
ROOM = bytes(WANT_SIZE)
"""What each PDU has room for."""


class Bid(NamedTuple):
    """What a burst tells; `waiting` None: nothing more."""

    waiting: Waiting | None
    record: Want

    @property
    def octets(self) -> bytes:
        """The record."""
        return build_records([self.record])


class Bids:
    """Tells what waits here, before a burst and after it."""

    def __init__(self, access: ByAuction, outbox: Outbox, composer: Composer, own_id: int) -> None:
        self._access = access
        self._outbox = outbox
        self._composer = composer
        self._own_id = own_id

    def waiting(self) -> Waiting | None:
        """Class and priority of the next message; None: none waits."""
        head = self._outbox.next_message
        return None if head is None else Waiting(head.qos, head.priority, 0.0, 0.0)

    def after(self, allowance: Allowance, airtime_s: AirtimeOf) -> Bid:
        """What will be left after a burst of as many PDUs as `allowance` has."""
        waiting = self._left(allowance, airtime_s)
        told = waiting or Waiting(Qos.BULK, 0, 0.0, 0.0)
        return Bid(waiting, want_of(self._own_id, told))

    def told(self, bid: Bid, start: float, built: Iterable[BuiltPdu]) -> None:
        """Note that a burst at `start` of these PDUs tells it, if it does."""
        if any(bid.octets in pdu.data for pdu in built):
            self._access.told(bid.waiting, start)

    def _left(self, allowance: Allowance, airtime_s: AirtimeOf) -> Waiting | None:
        k, one_s = self._composer.k_single, airtime_s(1)
        each_s = airtime_s(2) - one_s
        bytes_of, n_sent = self._outbox.waiting_bytes(), 0
        n_left: dict[Qos, int] = {}
        for qos, most in zip(Qos, allowance.most, strict=True):
            n = -(-bytes_of.get(qos, 0) // k)
            sent = min(n, max(0, most - n_sent))
            n_sent += sent
            if n > sent:
                n_left[qos] = n - sent
        if not n_left:
            return None
        first = min(n_left)
        priorities = [-level.key[1] for level in self._outbox.levels if level.qos is first]
        lower_s = each_s * sum(n for qos, n in n_left.items() if qos > first)
        return Waiting(
            first, max(priorities, default=0), 0.0, max(one_s, each_s * n_left[first]), lower_s
        )
