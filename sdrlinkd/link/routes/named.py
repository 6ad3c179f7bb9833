"""What others name this robot to forward, and the PDUs that it could still forward."""

from collections.abc import Callable
from math import inf

from sdrlinkd.link.routes.to_relay import PduToRelay
from sdrlinkd.wire import Need, Route, heard_number

LEASE_S = 3.0
"""Time in s for which a ROUTE counts."""
RECENT_S = 1.0
"""Time in s for which PDUs are kept that nobody has asked this robot to forward."""
MOST_RECENT = 512
LEAST_HOPS = 2
"""Fewest hops left in a PDU that is still forwarded."""
MOST_NAMED = 1024
"""Most pairs of source and destination."""

Ends = tuple[int, int]
"""(source, destination) of PDUs."""


class Named:
    """The ROUTE records that name this robot, and the PDUs of the last second."""

    def __init__(self, own_id: int) -> None:
        self._own_id = own_id
        self._until: dict[Ends, dict[int, float]] = {}
        """When each robot's ROUTE that names us ends."""
        self._alone: dict[Ends, bool] = {}
        """Whether the last ROUTE named us alone."""
        self._spare: dict[tuple[int, int, int], PduToRelay] = {}
        """By source, destination and sequence number, in the order of arrival."""

    def take(self, route: Route, teller: int, at: float) -> list[PduToRelay]:
        """Take a ROUTE of robot `teller`; returns PDUs that came before and are to be forwarded."""
        ends = route.src, route.dst
        known = self._until.get(ends, {})
        if self._own_id not in route.robots:
            known.pop(teller, None)
            if not known:
                self._until.pop(ends, None)
            return []
        if self._own_id in ends or (ends not in self._until and len(self._until) >= MOST_NAMED):
            return []
        self._until.setdefault(ends, known)[teller] = at + LEASE_S
        self._alone[ends] = len(route.robots) == 1
        return self._take_spare(
            at,
            lambda each: (
                (each.pdu.src, each.pdu.dst) == ends
                # Another teller than the source may itself be who has forwarded it.
                and not (each.is_passed_on and teller == route.src)
                and (each.number is None or each.number >= heard_number(each.number, route.number))
            ),
        )

    def is_named(self, ends: Ends, now: float) -> bool:
        """Whether this robot is to forward PDUs of a source to a destination."""
        known = self._until.get(ends)
        return known is not None and max(known.values(), default=-inf) > now

    def tellers(self, ends: Ends) -> frozenset[int]:
        """The robots that name this one to forward PDUs of a source to a destination."""
        return frozenset(self._until.get(ends, ()))

    def is_alone(self, ends: Ends) -> bool:
        """Whether nobody else was named beside this robot, so its forwarding is its answer."""
        return self._alone.get(ends, False)

    def needed(self, need: Need, at: float) -> list[PduToRelay]:
        """The PDUs kept that another robot asks for, and that are to be forwarded now."""
        if not self._spare:
            return []
        numbers = set(need.numbers())
        return self._take_spare(
            at,
            lambda each: (
                each.pdu.src == need.node
                and not each.is_passed_on
                and each.number in numbers
                and self.is_named((each.pdu.src, each.pdu.dst), at)
            ),
        )

    def keep(self, spare: PduToRelay) -> None:
        """Keep a PDU, as somebody may name this robot for it."""
        pdu, kept = spare.pdu, self._spare
        key = pdu.src, pdu.dst, pdu.seq
        kept.pop(key, None)
        kept[key] = spare
        if len(kept) > MOST_RECENT:
            del kept[next(iter(kept))]

    def forwarded(self, ends: Ends, seq: int, hops_left: int) -> None:
        """Note that another robot has forwarded a PDU.

        That robot may yet name this one as the next. Where the PDU went on from there, it named
        somebody else.
        """
        known = self._spare.get((*ends, seq))
        if known is None or hops_left >= known.pdu.hop:
            return
        is_next = hops_left == known.pdu.hop - 1 and hops_left >= LEAST_HOPS
        if is_next and not known.is_passed_on:
            self._spare[*ends, seq] = known.passed_on()
        else:
            del self._spare[*ends, seq]

    def expire(self, now: float) -> None:
        """Forget what has ended."""
        self._spare = {key: each for key, each in self._spare.items() if each.at >= now - RECENT_S}
        for ends, known in list(self._until.items()):
            for teller in [teller for teller, until in known.items() if until <= now]:
                del known[teller]
            if not known:
                del self._until[ends]
                self._alone.pop(ends, None)

    def begin_anew(self) -> None:
        """Go on with another clock."""
        self._until.clear()
        self._alone.clear()
        self._spare.clear()

    def _take_spare(self, at: float, suits: Callable[[PduToRelay], bool]) -> list[PduToRelay]:
        keys = [
            key for key, each in self._spare.items() if each.at >= at - RECENT_S and suits(each)
        ]
        return [self._spare.pop(key) for key in keys]
