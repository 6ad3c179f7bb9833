"""What a gateway reports about itself; units are part of the names, as in sdrlinkd/reports.py."""

from collections import Counter

import msgspec

UP = (
    "up_put", "up_left", "up_held", "up_repeated", "up_bridged", "up_not_selected", "up_away",
    "up_overflow",
)  # fmt: skip
"""Ends of messages from robots: put on Zenoh; left to another gateway, which put them; held, as it
is not known yet whether another one puts them; handed over by the daemon once more; sent by a
gateway for a robot on another air; of topics that `fleet.up` does not name; not put as no other
Zenoh node was reached; not put as too many puts waited.
"""
DOWN = (
    "down_sent", "down_left", "down_outdated", "down_again", "down_not_allowed",
    "down_unreadable", "down_refused", "down_no_daemon",
)  # fmt: skip
"""Ends of commands to robots: handed to the daemon; left to another gateway, at least so far; not
sent, for the reason in the name (fleet document, 5).
"""
BRIDGE = (
    "bridge_sent", "bridge_near", "bridge_left", "bridge_not_allowed", "bridge_repeated",
    "bridge_stop", "bridge_no_age", "bridge_waiting", "bridge_overflow", "bridge_refused",
    "bridge_no_daemon",
)  # fmt: skip
"""Ends of messages that other gateways put: handed to the daemon; not sent, as the robot is on this
air itself; left to another gateway of this air; of topics that `fleet.bridge` does not name; known;
stop messages, which each robot makes itself; last messages of unknown age; waiting for the daemon;
the oldest when too many waited; refused by the daemon; lost as it was away, or has just come back.
"""


class RobotHeard(msgspec.Struct, frozen=True, kw_only=True):
    """A robot that a gateway hears."""

    robot: int
    """Id of the robot."""
    leader: int | None
    """The gateway that leads for it; null: none does."""
    score: float | None
    """How well this gateway hears it (fleet document, 4); null: not at the moment."""
    hold_ms: float
    """How long a copy is held for the leader, in ms."""
    put_for_others: int
    """Messages that the leader did not put in time, and this gateway did."""
    put_twice: int
    """Messages that another gateway put, too."""


class GatewayReport(msgspec.Struct, frozen=True, kw_only=True):
    """A gateway at one moment."""

    gateway: int
    """Id of the gateway's own robot."""
    fleet: str
    """Name of the fleet."""
    is_reached: bool
    """Whether another Zenoh node is connected."""
    has_daemon: bool
    """Whether the daemon answers."""
    others: list[int]
    """The other gateways of the fleet."""
    robots: list[RobotHeard]
    """The robots that this gateway hears."""
    up: dict[str, int]
    """Messages from robots by their end; they add up to `up_taken`."""
    up_taken: int
    """Messages from robots."""
    up_again: int
    """Last messages of topics put again after the network was away; not among `up_taken`."""
    down: dict[str, int]
    """Commands to robots by their end; they add up to `down_taken`."""
    down_taken: int
    """Commands to robots."""
    bridges: bool
    """Whether it sends to its robots for those on other airs now."""
    bridge: dict[str, int]
    """Messages that other gateways put by their end; they add up to `bridge_taken`."""
    bridge_taken: int
    """Messages that other gateways put, with a `fleet.bridge`."""
    calls: dict[str, int]
    """Calls of robots' services by ROS 2 nodes, by how they ended."""
    puts_failed: int
    """Puts that Zenoh refused."""
    samples_dropped: int
    """Samples from Zenoh dropped because this program could not keep up."""
    queries_refused: int
    """Queries refused because too many waited."""


class Counts:
    """The counters of one gateway."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()

    def add(self, name: str, n: int = 1) -> None:
        """Count `n` more under a name of UP, DOWN or BRIDGE, or under one of those of a sum."""
        self._counts[name] += n

    def move(self, name: str, to: str) -> None:
        """Count one under another name."""
        self._counts[name] -= 1
        self._counts[to] += 1

    def of(self, names: tuple[str, ...]) -> dict[str, int]:
        """The counters of these names."""
        return {name: self._counts[name] for name in names}

    def __getitem__(self, name: str) -> int:
        return self._counts[name]
