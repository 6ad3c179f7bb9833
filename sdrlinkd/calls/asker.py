"""The half of a call that asks, without clock and sockets."""

from dataclasses import dataclass
from random import Random
from typing import NamedTuple

from sdrlinkd.calls.packet import Kind, Packet, Status
from sdrlinkd.calls.repeats import (
    FIRST_RTT_S,
    LONGEST_WAIT_S,
    MOST_TRIES,
    RESULT_KEPT_S,
    Repeats,
    Sent,
)

SHORTEST_WAIT_S = 0.1
TAKEN_WAIT_S = 10.0
"""Time in s after which a result that is under way is asked for again."""
TIMEOUT_ROUND_TRIPS = 25
LEAST_TIMEOUT_S = 5.0


class Ended(NamedTuple):
    """A call has ended; with status OK, `body` is the response."""

    number: int
    status: int
    body: bytes = b""


@dataclass
class _Asked:
    robot: int
    packet: Packet
    began_at: float
    deadline: float
    repeats: Repeats
    is_taken: bool = False


class Asker:
    """The half that calls. `boot` is the bridge's boot number.

    `timeout_s` is the time that a call may take; 0: by the round trips.
    """

    def __init__(self, boot: int, rng: Random) -> None:
        self._boot = boot
        self._rng = rng
        self._asked: dict[int, _Asked] = {}
        self._rtt_s: dict[int, float] = {}
        self._acks: list[Sent] = []
        self._number = 0

    def __len__(self) -> int:
        return len(self._asked)

    def rtt_s(self, robot: int) -> float:
        """The round trip to a robot, by the calls so far."""
        return self._rtt_s.get(robot, FIRST_RTT_S)

    def ask(
        self,
        robot: int,
        name: str,
        body: bytes,
        now: float,
        *,
        timeout_s: float = 0.0,
    ) -> int:
        """Begin a call; its number."""
        self._number += 1
        rtt_s = self.rtt_s(robot)
        timeout_s = timeout_s or max(LEAST_TIMEOUT_S, TIMEOUT_ROUND_TRIPS * rtt_s)
        wait_s = min(max(2 * rtt_s, SHORTEST_WAIT_S), LONGEST_WAIT_S)
        packet = Packet(Kind.REQUEST, self._boot, self._number, name, body=body)
        deadline = now + (RESULT_KEPT_S if packet.is_long else timeout_s)
        self._asked[self._number] = _Asked(robot, packet, now, deadline, Repeats(wait_s, now))
        return self._number

    def hear(self, robot: int, packet: Packet, now: float) -> Ended | None:
        """Take a packet from the other half; the end of a call, if it is one."""
        if packet.boot != self._boot:
            if packet.kind == Kind.ANSWER:
                # Nobody here waits for it any more, so it need not be sent again.
                self._acks.append(Sent(robot, Packet(Kind.ACK, packet.boot, packet.number)))
            return None
        asked = self._asked.get(packet.number)
        if packet.kind == Kind.ANSWER:
            # Every time, as the last one may have been lost.
            self._acks.append(Sent(robot, Packet(Kind.ACK, packet.boot, packet.number)))
        if asked is None or asked.robot != robot:
            return None
        if asked.repeats.tries == 1 and not asked.is_taken:
            measured_s, known_s = now - asked.began_at, self._rtt_s.get(robot)
            smooth_s = measured_s if known_s is None else 0.75 * known_s + 0.25 * measured_s
            self._rtt_s[robot] = smooth_s
        if packet.kind == Kind.TAKEN:
            asked.is_taken = True
            if asked.packet.is_long:
                # It lasts as long as the other half knows of it.
                asked.deadline = now + RESULT_KEPT_S
                asked.repeats.next_at = now + TAKEN_WAIT_S
            return None
        del self._asked[packet.number]
        return Ended(packet.number, packet.status, packet.body)

    def due(self, now: float) -> list[Sent]:
        """The packets to be sent at `now`."""
        due, self._acks = self._acks, []
        for asked in self._asked.values():
            repeats = asked.repeats
            may_repeat = repeats.tries < MOST_TRIES or asked.packet.is_long
            if may_repeat and now >= repeats.next_at:
                repeats.again(now, self._rng)
                due.append(Sent(asked.robot, asked.packet._replace(age_s=now - asked.began_at)))
        return due

    def drop(self, number: int) -> None:
        """Forget a call that cannot be sent."""
        self._asked.pop(number, None)

    def expired(self, now: float) -> list[Ended]:
        """The calls whose time is over."""
        over = [number for number, asked in self._asked.items() if now >= asked.deadline]
        for number in over:
            del self._asked[number]
        return [Ended(number, Status.TIMED_OUT) for number in over]
