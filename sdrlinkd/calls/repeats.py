"""When the packets of a call are sent again."""

from random import Random
from typing import NamedTuple

from sdrlinkd.calls.packet import Packet

FIRST_RTT_S = 0.3
"""Round trip in s that is assumed before the first one was measured."""
LONGEST_WAIT_S = 3.0
GROWTH = 1.3
"""Factor between the waits for two repeats."""
SPREAD = 0.25
MOST_TRIES = 12
RESULT_KEPT_S = 900.0
"""Time in s for which the result of an action is kept, and asked for."""


class Sent(NamedTuple):
    """A packet to be sent to a robot."""

    robot: int
    packet: Packet


class Repeats:
    """When a packet is sent again: in growing waits, each a little longer or shorter by chance."""

    def __init__(self, wait_s: float, now: float) -> None:
        self._wait_s = wait_s
        self.next_at = now
        self.tries = 0

    def again(self, now: float, rng: Random) -> None:
        """Note that it is sent at `now`."""
        self.tries += 1
        self.next_at = now + self._wait_s * rng.uniform(1 - SPREAD, 1 + SPREAD)
        self._wait_s = min(LONGEST_WAIT_S, GROWTH * self._wait_s)
