"""A robot's sealing and what its disk keeps of it, or does not."""

from random import Random

from sdrlinkd.sealing import Remembered, Sealing
from sdrlinkd.wire import (
    BROADCAST,
    CONTROL_TOPIC_ID,
    N_TICKS,
    Entry,
    Pdu,
    build,
    build_records,
    parse_sealed,
)
from tests.sealing.team import KEY, NEW, NEXT, SEALED

SIZE = 64


class Machine:
    """One robot's sealing over its lives, and every number that it has used.

    `age_s` is true time since its keys were made. `is_synchronized`: its host knows that, too.
    `is_heard`: another robot hears what it sends; `is_answered`: it hears what that one answers.
    """

    def __init__(self, seed=1):
        self._chance = Random(seed)
        self.disk, self.disk_is = NEW, "works"
        self.now, self.seq = 0.0, 0
        self.used, self.sent = set(), 0
        self.last = []
        self.age_s = 0.0
        self.is_synchronized = self.is_heard = self.is_answered = True
        self.heard, self.answers = {KEY: 0, NEXT: 0}, 0
        self.restart([KEY])

    def restart(self, keys):
        usable = [key for key in keys if key.fingerprint not in self.disk.retired]
        keys = usable or [key for key in (KEY, NEXT) if key.fingerprint not in self.disk.retired]
        self.sealing = Sealing(1, SIZE, SEALED, keys, self.disk, self._chance.randbytes)
        # Each life begins with the same sequence number, so that equal T are equal numbers.
        self.now, self.last, self.seq = 0.0, [], 0
        self.sealing.look(0.0)

    def lose(self, keys, is_synchronized, is_heard, is_answered):
        """Another disk, with the same keys."""
        self.disk = Remembered()
        self.is_synchronized, self.is_heard, self.is_answered = (
            is_synchronized,
            is_heard,
            is_answered,
        )
        self.restart(keys)

    def resume(self):
        """Ask whom it may concern for numbers that are lost, and go on once they are known."""
        sealing = self.sealing
        ages_s = {key.fingerprint: self.age_s for key in (KEY, NEXT)}
        sealing.tell_ages(ages_s if self.is_synchronized else {}, self.now)
        sealing.look(self.now)
        if sealing.is_lost and sealing.clear_due_at <= self.now:
            question = in_pdu(SIZE, 1, sealing.told_in_clear(self.now))
            if self.is_answered:
                sealing.opener.open(self.answer(question), self.now)
            sealing.look(self.now)

    def answer(self, question):
        """What a robot says that has heard this one before, and has no clock."""
        newest = {key.fingerprint: {1: ticks} for key, ticks in self.heard.items()}
        self.answers += 1
        floor = 3200 * self.answers
        disk = Remembered({KEY.fingerprint: floor, NEXT.fingerprint: floor}, newest)
        keys = [key for key in (KEY, NEXT) if key.kid == self.sealing.report(self.now).kid]
        other = Sealing(2, SIZE, SEALED, keys, disk, lambda n: bytes(n))
        other.memory.written(other.memory.wanted(0.0))
        other.may_send(0.0, 0, 1)
        assert other.opener.refuses_clear(question, self.age_s)
        (found,) = other.found(self.age_s)
        return other.seal(in_pdu(SIZE - 14, 2, found), 0.0)

    def write(self):
        memory = self.sealing.memory
        wanted = memory.wanted(self.now)
        if wanted is None:
            return
        if self.disk_is == "full":
            memory.not_written("No space left on device")
            return
        # With the power cut, what was written is on disk, and nobody knows.
        self.disk = wanted
        if self.disk_is == "works":
            memory.written(wanted)

    def send(self, n):
        for _ in range(n):
            if not self.sealing.may_send(self.now, self.seq, 1):
                return
            inner = bytes((0, 1, 255, self.seq, 0x11)) + bytes(SIZE - 14 - 5)
            self.note(self.sealing.seal(inner, self.now))
            self.last.append((inner, self.now))
            self.seq = (self.seq + 1) & 0xFF

    def note(self, data):
        pdu = parse_sealed(data, SIZE)
        assert pdu.ticks < N_TICKS
        number = (pdu.kid, pdu.ticks, pdu.seq)
        assert number not in self.used
        self.used.add(number)
        if self.is_heard:
            key = NEXT if pdu.kid else KEY
            self.heard[key] = max(self.heard[key], pdu.ticks)

    def do(self, kind, value):
        if kind == "send":
            self.write()
            self.send(value)
        elif kind == "time":
            self.now += value
            self.age_s += max(value, 0.0)
            self.resume()
        elif kind == "off":
            self.age_s += value
        elif kind == "late" and self.last:
            # It did not leave, and is sealed anew, as its content depends on the start.
            inner, start = self.last[-1]
            self.now = max(self.now, start + value)
            if self.sealing.may_send(self.now, inner[3], 1):
                self.note(self.sealing.seal(inner, self.now))
        elif kind == "disk":
            self.disk_is = value
        elif kind == "anew":
            self.sealing.begin_anew()
        elif kind == "install":
            floors = {key.fingerprint: self.disk.floors.get(key.fingerprint, 0) for key in value}
            self.sealing.install(value, self.disk._replace(floors=floors))
            # What is sent before the disk is asked again.
            self.send(5)
        elif kind == "restart":
            self.restart(value)
        elif kind == "lose":
            self.lose(*value)


def in_pdu(size, src, record):
    """A PDU of `src` with one record."""
    entry = Entry(CONTROL_TOPIC_ID, 0, 0, 1, build_records([record]))
    return build(Pdu(0, False, src, BROADCAST, 0, 1, [entry]), size)
