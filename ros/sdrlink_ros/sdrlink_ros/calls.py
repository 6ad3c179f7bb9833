"""Service calls over a lossy radio, executed at most once: both halves, without clock and sockets.

A request is repeated until its answer, or word that it was taken, comes. The answer is repeated
until it is acknowledged. A request has a number and the boot number of its bridge, by which the
other half recognises repeats: it answers them again, but never executes one twice.
"""

from collections import OrderedDict
from dataclasses import dataclass
from random import Random
from typing import NamedTuple

from sdrlink_ros.packet import MOST_KEPT, Kind, Packet, Status

FIRST_RTT_S = 0.3
"""Round trip in s that is assumed before the first one was measured."""
SHORTEST_WAIT_S, LONGEST_WAIT_S = 0.1, 3.0
GROWTH = 1.3
"""Factor between the waits for two repeats."""
SPREAD = 0.25
MOST_TRIES = 12
TAKEN_WAIT_S = 10.0
"""Time in s after which a result that is under way is asked for again."""
UNKNOWN_AGE_S = 60.0
"""Age in s that a request is taken to have if it is not known."""
TIMEOUT_ROUND_TRIPS = 25
LEAST_TIMEOUT_S = 5.0
KEPT_S = 120.0
"""Time in s for which an answer is kept, in case its request comes again."""
RESULT_KEPT_S = 900.0
"""Time in s for which the result of an action is kept, and asked for."""
MOST_TURNED_AWAY = 1024


class Sent(NamedTuple):
    """A packet to be sent to a robot."""

    robot: int
    packet: Packet


class Ended(NamedTuple):
    """A call has ended; with status OK, `body` is the response."""

    number: int
    status: int
    body: bytes = b""


class _Repeats:
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


@dataclass
class _Asked:
    robot: int
    packet: Packet
    began_at: float
    deadline: float
    repeats: _Repeats
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
        self._asked[self._number] = _Asked(robot, packet, now, deadline, _Repeats(wait_s, now))
        return self._number

    def hear(self, robot: int, packet: Packet, now: float) -> Ended | None:
        """Take a packet from the other half; the end of a call, if it is one."""
        if packet.boot != self._boot:
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


class Key(NamedTuple):
    """What identifies a call at the other half."""

    robot: int
    boot: int
    number: int


@dataclass
class _Running:
    is_long: bool
    since: float
    answer: Packet | None = None
    is_acknowledged: bool = False
    """Whether the other half has the answer."""
    repeats: _Repeats | None = None

    def is_over(self, now: float) -> bool:
        return now - self.since > (RESULT_KEPT_S if self.is_long else KEPT_S)


class Answerer:
    """The half that executes; it began at `began_at`."""

    def __init__(self, began_at: float, rng: Random) -> None:
        self._began_at = began_at
        self._rng = rng
        self._calls: OrderedDict[Key, _Running] = OrderedDict()
        self._turned_away: OrderedDict[Key, None] = OrderedDict()
        """The last calls for which there was no room."""
        self._out: list[Sent] = []

    def __len__(self) -> int:
        return sum(not call.is_acknowledged for call in self._calls.values())

    def hear(self, robot: int, packet: Packet, took_s: float | None, now: float) -> Key | None:
        """Take a packet that was `took_s` on its way, None if unknown.

        Returns a call that is new, and to be executed.
        """
        key = Key(robot, packet.boot, packet.number)
        call = self._calls.get(key)
        if packet.kind == Kind.ACK:
            if call is not None and call.answer is not None:
                call.is_acknowledged = True
            return None
        if packet.kind != Kind.REQUEST:
            return None
        if call is not None:
            # A repeat: the answer, or word that it runs, was lost.
            if call.answer is None:
                call.since = now
            self._out.append(Sent(robot, call.answer or _taken(key)))
            return None
        if key in self._turned_away or not self._has_room(robot):
            self._turned_away[key] = None
            while len(self._turned_away) > MOST_TURNED_AWAY:
                self._turned_away.popitem(last=False)
            answer = Packet(Kind.ANSWER, key.boot, key.number, status=Status.BUSY)
            self._out.append(Sent(robot, answer))
            return None
        self._calls[key] = _Running(packet.is_long, now)
        status = self._refusal(packet, took_s, now)
        if status != Status.OK:
            self.answer(key, status, b"", now)
            return None
        if packet.is_long:
            self._out.append(Sent(robot, _taken(key)))
        return key

    def answer(self, key: Key, status: int, body: bytes, now: float) -> None:
        """Send the answer of a call, and keep it."""
        call = self._calls.get(key)
        if call is None or call.answer is not None:
            return
        call.answer = Packet(Kind.ANSWER, key.boot, key.number, status=status, body=body)
        call.since = now
        call.repeats = _Repeats(2 * FIRST_RTT_S, now)

    def too_large(self, packet: Packet, robot: int) -> None:
        """Tell the caller that its answer does not fit the link."""
        call = self._calls.get(Key(robot, packet.boot, packet.number))
        if call is not None and call.answer is not None and call.answer.body:
            call.answer = call.answer._replace(status=Status.TOO_LARGE, body=b"")

    def due(self, now: float) -> list[Sent]:
        """The packets to be sent at `now`."""
        due, self._out = self._out, []
        for key in [key for key, call in self._calls.items() if call.is_over(now)]:
            del self._calls[key]
        for key, call in self._calls.items():
            if call.repeats is None or call.answer is None or call.is_acknowledged:
                continue
            may_repeat = call.repeats.tries < MOST_TRIES or call.is_long
            if may_repeat and now >= call.repeats.next_at:
                call.repeats.again(now, self._rng)
                due.append(Sent(key.robot, call.answer))
        return due

    def _has_room(self, robot: int) -> bool:
        """Whether a robot may call; its oldest call that is done makes room."""
        of_robot = [key for key in self._calls if key.robot == robot]
        if len(of_robot) < MOST_KEPT:
            return True
        oldest = next((key for key in of_robot if self._calls[key].is_acknowledged), None)
        if oldest is not None:
            del self._calls[oldest]
        return oldest is not None

    def _refusal(self, packet: Packet, took_s: float | None, now: float) -> int:
        # A result can be asked for as often as one likes.
        age_s = packet.age_s + (UNKNOWN_AGE_S if took_s is None else took_s)
        is_older = age_s > now - self._began_at
        return Status.RESTARTED if is_older and not packet.is_long else Status.OK


def _taken(key: Key) -> Packet:
    return Packet(Kind.TAKEN, key.boot, key.number)
