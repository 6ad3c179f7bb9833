"""The half of a call that executes, without clock and sockets."""

from collections import OrderedDict
from dataclasses import dataclass
from random import Random
from typing import NamedTuple

from sdrlinkd.calls.packet import MOST_KEPT, Kind, Packet, Status
from sdrlinkd.calls.repeats import FIRST_RTT_S, MOST_TRIES, RESULT_KEPT_S, Repeats, Sent

UNKNOWN_AGE_S = 60.0
"""Age in s that a request is taken to have if it is not known."""
KEPT_S = 120.0
"""Time in s for which an answer is kept, in case its request comes again; an older one is refused,
as it may be one that was executed and forgotten."""
MOST_TURNED_AWAY = 1024


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
    repeats: Repeats | None = None

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
        call.repeats = Repeats(2 * FIRST_RTT_S, now)

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
        # A result can be asked for, and a goal be cancelled, as often as one likes.
        age_s = packet.age_s + (UNKNOWN_AGE_S if took_s is None else took_s)
        is_older = age_s > min(now - self._began_at, KEPT_S)
        return Status.RESTARTED if is_older and not packet.is_long else Status.OK


def _taken(key: Key) -> Packet:
    return Packet(Kind.TAKEN, key.boot, key.number)
