"""A robot's sealing and what its disk keeps of it."""

from sdrlinkd.sealing import Remembered, Sealing
from sdrlinkd.wire import N_TICKS, parse_sealed
from tests.sealing.team import KEY, NEXT, SEALED

SIZE = 64


class Machine:
    """One robot's sealing over its lives, and every number that it has used."""

    def __init__(self):
        self.disk, self.disk_is = Remembered(), "works"
        self.now, self.seq = 0.0, 0
        self.used, self.sent = set(), 0
        self.last = []
        self.restart([KEY])

    def restart(self, keys):
        usable = [key for key in keys if key.fingerprint not in self.disk.retired]
        keys = usable or [key for key in (KEY, NEXT) if key.fingerprint not in self.disk.retired]
        self.sealing = Sealing(1, SIZE, SEALED, keys, self.disk, lambda n: bytes(n))
        self.now, self.last = 0.0, []

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

    def do(self, kind, value):
        if kind == "send":
            self.write()
            self.send(value)
        elif kind == "time":
            self.now += value
            self.sealing.look(self.now)
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
