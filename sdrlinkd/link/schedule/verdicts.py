"""The ADMIT records of a team: which flows its planner has admitted, and which it has refused."""

from collections.abc import Iterable
from dataclasses import dataclass

from sdrlinkd.link.schedule.admitted import FlowKey
from sdrlinkd.link.schedule.flow_table import GONE_S, MOST_ROBOTS
from sdrlinkd.wire import BROADCAST, FLOWS_NUMBERS, MOST_FLOWS, Admit, is_newer_number


@dataclass(slots=True)
class _Held:
    record: Admit
    at: float
    is_restarted: bool = False
    """Whether any number counts as newer, as the planner has restarted."""


class Verdicts:
    """The newest ADMIT record about each robot; our own ones are numbered from `first` on."""

    def __init__(self, own_id: int, first: int) -> None:
        self._own_id = own_id
        self._number = first % FLOWS_NUMBERS
        self._held: dict[int, _Held] = {}

    def record(self, node: int) -> Admit | None:
        """The newest record about a robot; None if none is held (any more)."""
        held = self._held.get(node)
        return None if held is None else held.record

    def of_planner(self, planner: int) -> list[int]:
        """The robots about which this planner's word is held."""
        return [node for node, each in sorted(self._held.items()) if each.record.planner == planner]

    def admitted(self) -> set[FlowKey]:
        """The flows that were admitted, by whichever planner."""
        held = self._held.items()
        return {(node, topic) for node, each in held for topic in each.record.admitted}

    def word(self, key: FlowKey) -> bool | None:
        """Whether a flow was admitted; None: nothing was said of it."""
        node, topic = key
        record = self.record(node)
        if record is None or topic not in record.admitted + record.refused:
            return None
        return topic in record.admitted

    def take(self, record: Admit, teller: int, at: float) -> bool:
        """Take a record that robot `teller` told; returns whether it is news."""
        held = self._held.get(record.node)
        if held is None and len(self._held) >= MOST_ROBOTS:
            return False
        if held is not None and held.record.planner == record.planner:
            is_new_life = held.is_restarted and teller == record.planner
            is_news = is_newer_number(record.number, held.record.number) or is_new_life
            if not is_news or record == held.record:
                return False
        self._held[record.node] = _Held(record, at)
        return True

    def decide(self, node: int, topics: Iterable[int], given: set[FlowKey], now: float) -> bool:
        """Give our word on a robot's flows: those in `given` are admitted.

        Returns whether that is another word than before.
        """
        listed = sorted(topics)
        admitted = bytes(topic for topic in listed if (node, topic) in given)
        refused = bytes(topic for topic in listed if (node, topic) not in given)
        held = self._held.get(node)
        if held is not None and held.record.planner == self._own_id:
            held.at = now
            if (held.record.admitted, held.record.refused) == (admitted, refused):
                return False
        self._hold_ours(Admit(self._own_id, 0, node, admitted, refused), now)
        return True

    def renew(self, node: int, now: float) -> None:
        """Give our word on a robot's flows a new number."""
        held = self._held.get(node)
        if held is not None and held.record.planner == self._own_id:
            self._hold_ours(held.record, now)

    def overtaken(self, number: int) -> None:
        """Go on behind a number that an earlier life of ours has used."""
        if is_newer_number(number, self._number):
            self._number = number

    def restarted(self, planner: int) -> None:
        """Take the next records of a planner for newer, whatever their numbers."""
        for held in self._held.values():
            held.is_restarted = held.is_restarted or held.record.planner == planner

    def expire(self, now: float) -> None:
        """Forget what was not said again for long."""
        for node in [node for node, each in self._held.items() if now - each.at > GONE_S]:
            del self._held[node]

    def begin_anew(self) -> None:
        """Go on with another clock: only what comes from now on counts."""
        self._held.clear()

    def _hold_ours(self, record: Admit, now: float) -> None:
        self._number = (self._number + 1) % FLOWS_NUMBERS
        self._held[record.node] = _Held(record._replace(number=self._number), now)


def is_sound_word(record: Admit) -> bool:
    """Whether an ADMIT record can be true: no topic twice, and a robot of the team."""
    topics = record.admitted + record.refused
    return (
        BROADCAST not in (record.node, record.planner)
        and len(topics) <= MOST_FLOWS
        and len(set(topics)) == len(topics)
    )
