"""The flows that the robots of a team want air for, as their FLOWS records say."""

from dataclasses import dataclass

from sdrlinkd.wire import ALL_AIR, BROADCAST, MOST_FLOWS, Flows, ReservedFlow, is_newer_number

MOST_ROBOTS = 32
"""Most robots of which flows are held."""
GONE_S = 31.0
"""Time in s without a FLOWS record after which the flows of a robot are forgotten."""


@dataclass(slots=True)
class _Held:
    record: Flows
    at: float
    is_restarted: bool = False
    """Whether any number counts as newer, as the robot has restarted."""


class FlowTable:
    """The newest FLOWS record of each robot; `version` counts the changes of what they ask for."""

    def __init__(self) -> None:
        self._held: dict[int, _Held] = {}
        self.version = 0

    def flows(self) -> list[tuple[int, ReservedFlow]]:
        """(robot, flow) of all flows, in ascending order."""
        return sorted(
            (node, flow) for node, held in self._held.items() for flow in held.record.flows
        )

    def record(self, node: int) -> Flows | None:
        """The newest record of a robot; None if it is not held (any more)."""
        held = self._held.get(node)
        return None if held is None else held.record

    def robots(self) -> list[int]:
        """The robots of which a record is held."""
        return sorted(self._held)

    def take(self, record: Flows, teller: int, at: float) -> bool:
        """Take a record that robot `teller` told; returns whether it is news."""
        held = self._held.get(record.node)
        if held is None and len(self._held) >= MOST_ROBOTS:
            return False
        if held is not None and not is_newer_number(record.number, held.record.number):
            is_new_life = held.is_restarted and teller == record.node
            if not is_new_life or record == held.record:
                return False
        self.hold(record, at)
        return True

    def hold(self, record: Flows, at: float) -> None:
        """Hold a record in place of the one before."""
        before = self._held.get(record.node)
        self._held[record.node] = _Held(record, at)
        if before is None or before.record.flows != record.flows:
            self.version += 1

    def restarted(self, node: int) -> None:
        """Take the next record that a robot tells itself for newer, whatever its number."""
        held = self._held.get(node)
        if held is not None:
            held.is_restarted = True

    def expire(self, own_id: int, now: float) -> None:
        """Forget the flows of robots of which nothing was told for long."""
        gone = [node for node, each in self._held.items() if now - each.at > GONE_S]
        for node in gone:
            if node != own_id:
                del self._held[node]
                self.version += 1

    def begin_anew(self) -> None:
        """Go on with another clock: only what comes from now on counts."""
        self._held.clear()
        self.version += 1


def is_sound(record: Flows) -> bool:
    """Whether a FLOWS record can be true: no flow twice, no more than all of the air each."""
    flows = record.flows
    return (
        record.node != BROADCAST
        and len(flows) <= MOST_FLOWS
        and len({flow.topic for flow in flows}) == len(flows)
        and all(0 < flow.air <= ALL_AIR and flow.period_us and flow.size for flow in flows)
    )
