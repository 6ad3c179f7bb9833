"""No number twice, whatever happens to clocks, power and disk."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.sealing import Remembered, Sealing
from sdrlinkd.wire import N_TICKS, parse_sealed
from tests.laws import law
from tests.sealing.team import KEY, NEXT, SEALED, Robot, Team

SIZE = 64
events = st.one_of(
    st.tuples(st.just("send"), st.integers(1, 300)),
    # Time passes, a little or a lot; the link's clock may also go back, where a radio's does.
    st.tuples(st.just("time"), st.floats(-5.0, 120.0)),
    st.tuples(st.just("late"), st.floats(0.0, 3.0)),
    st.tuples(st.just("disk"), st.sampled_from(["works", "full", "cut"])),
    st.tuples(st.just("anew"), st.none()),
    st.tuples(st.just("restart"), st.sampled_from([[KEY], [NEXT], [KEY, NEXT]])),
    st.tuples(st.just("install"), st.sampled_from([[KEY], [NEXT], [KEY, NEXT], [NEXT, KEY]])),
)


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


@law(300)
@given(st.lists(events, max_size=40))
def test_no_number_is_used_twice(script):
    machine = Machine()
    for event in script:
        machine.do(*event)
    machine.disk_is = "works"
    machine.do("restart", [KEY, NEXT])
    before = len(machine.used)
    machine.do("send", 10)
    assert len(machine.used) == before + 10


def test_at_most_256_pdus_in_a_tick():
    machine = Machine()
    machine.write()
    machine.now = 0.001
    machine.send(1000)
    assert len(machine.used) == 256
    assert machine.sealing.report(machine.now).waits == 1
    machine.now += 1 / 32
    machine.send(1000)
    assert len(machine.used) == 512


@pytest.mark.slow
def test_a_full_disk_stops_sealing_before_the_floor_and_says_so():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    robot = team.robots[1]
    team.run(1.0)
    robot.disk_works = False
    (floor,) = robot.disk.floors.values()
    team.run(floor / 32 + 5)
    report = robot.link.report(robot.clock(team.now)).security
    assert "cannot be written to disk: No space left" in report.halted
    mine = [data for _, src, data in team.on_air if src == 1]
    assert max(parse_sealed(data, 128).ticks for data in mine) < floor
    robot.disk_works = True
    n = len(team.on_air)
    team.run(2.0)
    assert robot.link.report(robot.clock(team.now)).security.halted == ""
    assert any(src == 1 for _, src, _ in team.on_air[n:])


def test_a_key_is_used_up():
    near_end = Remembered({KEY.fingerprint: N_TICKS - 32 * 60}, {}, KEY.fingerprint)
    team = Team(Robot(1, [KEY], disk=near_end), Robot(2, [KEY]))
    robot = team.robots[1]
    team.run(1.0)
    notices = robot.link.notices(robot.clock(team.now))
    assert any("can be used for 0 more days: make the next one" in each for each in notices)
    team.run(40.0)
    assert "key 0 is used up" in robot.link.report(robot.clock(team.now)).security.halted
    robot.link.submit(1, b"\0\1\0\0", robot.clock(team.now))
    n = len(team.on_air)
    team.run(2.0)
    assert all(src != 1 for _, src, _ in team.on_air[n:])
