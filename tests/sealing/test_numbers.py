"""No number twice, whatever happens to clocks, power and disk."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.sealing import Remembered
from sdrlinkd.wire import N_TICKS, parse_sealed
from tests.laws import law
from tests.sealing.machine import Machine
from tests.sealing.team import KEY, NEXT, Robot, Team

events = st.one_of(
    st.tuples(st.just("send"), st.integers(1, 300)),
    # It is switched off for some days.
    st.tuples(st.just("off"), st.floats(0.0, 10 * 86_400.0)),
    # Time passes, a little or a lot; the link's clock may also go back, where a radio's does.
    st.tuples(st.just("time"), st.floats(-5.0, 120.0)),
    st.tuples(st.just("late"), st.floats(0.0, 3.0)),
    st.tuples(st.just("disk"), st.sampled_from(["works", "full", "cut"])),
    st.tuples(st.just("anew"), st.none()),
    st.tuples(st.just("restart"), st.sampled_from([[KEY], [NEXT], [KEY, NEXT]])),
    st.tuples(st.just("install"), st.sampled_from([[KEY], [NEXT], [KEY, NEXT], [NEXT, KEY]])),
    st.tuples(
        st.just("lose"),
        st.tuples(
            st.sampled_from([[KEY], [NEXT], [KEY, NEXT]]),
            st.booleans(),
            st.booleans(),
            st.booleans(),
        ),
    ),
)


@pytest.mark.slow
@law(300)
@given(st.lists(events, max_size=40))
def test_no_number_is_used_twice(script):
    machine = Machine()
    for event in script:
        machine.do(*event)
    machine.disk_is = "works"
    machine.do("restart", [KEY, NEXT])
    machine.is_synchronized = True
    for _ in range(2):
        machine.do("time", 25.0)
    machine.write()
    before = len(machine.used)
    if "used up" in machine.sealing.halted:
        return
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
    floor = robot.disk.floors[KEY.fingerprint]
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


@pytest.mark.slow
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
