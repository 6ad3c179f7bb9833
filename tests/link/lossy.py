"""Robots that lose PDUs of each other, as a test says, and repeat what is asked for."""

from collections import Counter

from sdrlinkd.link import AS_CONFIGURED, ClockParams, RepeatParams
from sdrlinkd.wire import is_sealed
from tests.link.steps import Steps
from tests.link.world import make_link, next_burst, records_in

STEP_S = 0.002
AIR_S = 0.001
PDU_SIZE = 128


def message(number, size=40):
    return b"\0\1\0\0" + number.to_bytes(4, "little") + bytes(size)


class Air(Steps):
    """Robots of which `lost(to, src, n, pdu)` says which PDU, the n-th on the air, is not heard."""

    def __init__(self, robots=(1, 2), lost=lambda *_: False, share=0.05, hears=None, **params):
        params = {"pdu_size": PDU_SIZE, "beacon_s": 1.0, "clock": ClockParams(), **params}
        self._params = {"repeat": RepeatParams(share=share), **params}
        links = {robot: make_link(robot, seed=robot, **self._params) for robot in robots}
        super().__init__(links, STEP_S, next_burst, most_bursts=1)
        self._lost = lost
        self.hears = hears
        self.n_sent = Counter()
        self.sent_at = {}
        self.got = []
        """(robot, number, true age in s, told age in s) of the messages handed over."""

    def arrivals(self, to, src, burst):
        if self.hears is not None and (to, src) not in self.hears:
            return
        for pdu in burst.pdus:
            self.n_sent[to, src] += 1
            if not self._lost(to, src, self.n_sent[to, src], pdu):
                yield AIR_S, 20.0, pdu

    def restart(self, robot, seed):
        """Start a robot anew, or let a new one join."""
        self.links[robot] = make_link(robot, seed=seed, **self._params)

    def submit(self, src, number, size=40, overrides=AS_CONFIGURED):
        self.sent_at[number] = self.now
        self.links[src].submit(0, message(number, size), self.now, overrides)

    def take(self, robot, message):
        number = int.from_bytes(message.payload[4:8], "little")
        age_s = self.links[robot].delivered(message, self.now)
        self.got.append((robot, number, self.now - self.sent_at[number], age_s))

    def numbers(self, robot):
        return [number for got_by, number, *_ in self.got if got_by == robot]

    def flow(self, src, n, every_s=0.01, first=0, **kinds):
        for number in range(first, first + n):
            self.submit(src, number, **kinds)
            self.run(self.now + every_s)

    def records(self, src):
        """All records that a robot sent, with the time."""
        return [
            (at, record)
            for at, robot, burst in self.bursts
            if robot == src
            for pdu in burst.pdus
            if not is_sealed(pdu) and pdu[1] == src
            for record in records_in(pdu, PDU_SIZE)
        ]


def carries(number):
    """Whether a PDU holds the message of that number."""
    return lambda pdu: message(number)[4:8] in pdu and b"\0\1\0\0" + message(number)[4:8] in pdu


def once(*numbers):
    """Loses the first PDU with each of these messages."""
    left = set(numbers)

    def lost(_to, src, _n, pdu):
        for number in left if src == 1 else ():
            if carries(number)(pdu):
                left.discard(number)
                return True
        return False

    return lost
