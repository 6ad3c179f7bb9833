"""Any octets from the air: nothing breaks, nothing forged arrives, and the ledger adds up."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import AccessParams, Outcome
from sdrlinkd.sealing import Key, Remembered, SecurityParams
from sdrlinkd.sealing.testing import Ciphers
from sdrlinkd.wire import KeyTold, delayed, parse, parse_sealed, read_control_entries
from tests.laws import law
from tests.sealing.team import KEY, Robot, Team
from tests.sealing.vectors import with_crc

CDR = b"\0\1\0\0"
SIZE = 128


def spoken(clear="refuse"):
    """A robot that has proven itself to another, and what it sent."""
    team = Team(Robot(1, [KEY]), Robot(2, [KEY], SecurityParams(mode="seal", clear=clear)))
    team.run(1.0)
    for number in range(20):
        team.robots[1].link.submit(0, CDR + bytes([number]), team.robots[1].clock(team.now))
        team.run(0.01)
    return team, [data for _, src, data in team.on_air if src == 1]


changes = st.lists(st.tuples(st.integers(0, SIZE - 3), st.integers(0, 255)), min_size=1, max_size=6)
hostile = st.one_of(
    st.binary(max_size=SIZE + 2),
    st.binary(min_size=SIZE - 2, max_size=SIZE - 2).map(with_crc),
    st.builds(
        lambda first, body: with_crc(bytes([first]) + body),
        st.sampled_from([0x00, 0x01, 0x05, 0x0D, 0x0F, 0x11]),
        st.binary(min_size=SIZE - 3, max_size=SIZE - 3),
    ),
    st.tuples(st.integers(0, 200), changes),
)


@pytest.mark.slow
@law(30)
@given(st.sampled_from(["refuse", "accept"]), st.lists(hostile, max_size=60))
def test_whatever_comes(clear, script):
    team, sent = spoken(clear)
    robot = team.robots[2]
    before = list(robot.heard)
    for each in script:
        if isinstance(each, bytes):
            robot.hear(each, team.now)
            continue
        # A PDU of the other robot, changed on its way.
        index, changes = each
        changed = bytearray(sent[index % len(sent)])
        for at, value in changes:
            changed[at] = value
        robot.hear(with_crc(bytes(changed[:-2])), team.now)
        team.run(0.005)
    assert robot.heard == before
    assert robot.link.audit() == []
    # The robot still hears what is true.
    n = len(robot.heard)
    team.robots[1].link.submit(0, CDR + b"x", team.robots[1].clock(team.now))
    team.run(0.5)
    assert [each.payload for each in robot.heard[n:]] == [CDR + b"x"]


def test_a_burst_that_comes_back_is_sealed_once():
    """Only how long it was held changes; what depends on the start is made anew."""
    access = AccessParams(policy="tdma", nodes=[1, 2], slot_s=0.025, guard_s=0.002, reuse=False)
    team = Team(*(Robot(each, [KEY], access=access) for each in (1, 2)))
    numbers, held, late = {}, 0, 0
    outcomes = iter([Outcome.LATE, Outcome.LATE, Outcome.SENT] * 1000)
    team.outcome = lambda: next(outcomes)
    for number in range(60):
        team.robots[1].link.submit(0, CDR + bytes([number]), team.robots[1].clock(team.now))
        team.run(0.1)
    for burst in team.composed:
        for data in burst.pdus:
            pdu = parse_sealed(data, SIZE)
            body = data[11:-2]
            assert numbers.setdefault((pdu.src, pdu.ticks, pdu.seq), body) == body
            held += pdu.held > 0
        late += burst.start > burst.first_start
    assert held > 20
    assert late > 20
    heard = team.robots[2].heard
    assert len(heard) > 40
    assert all(each.age_s > 0.0 for each in heard)
    assert team.robots[2].link.audit() == team.robots[1].link.audit() == []


def test_what_was_held_on_its_way_sets_no_clock_and_no_schedule():
    """An attacker can hold a PDU and say so; nobody vouches for the exact time."""
    access = AccessParams(policy="tdma", nodes=[1, 2], slot_s=0.025, guard_s=0.002, reuse=False)
    team = Team(*(Robot(each, [KEY], access=access) for each in (1, 2)))

    def hold(receiver, data):
        team.plays_at(team.now + 0.1, receiver, delayed(data, 100_000))
        return False

    team.tamper = hold
    two = team.robots[2]
    for number in range(200):
        team.robots[1].link.submit(0, CDR + bytes([number]), team.robots[1].clock(team.now))
        team.run(0.05)
    assert len(two.heard) > 50
    assert min(each.age_s for each in two.heard) >= 0.1
    assert two.link.clock_estimate(1, two.clock(team.now)) is None
    assert "schedule of robot 2" in two.link.report(two.clock(team.now)).access


def test_entries_that_contradict_themselves_are_refused_although_they_open():
    team, sent = spoken()
    robot = team.robots[2]
    last = max(parse_sealed(data, SIZE).ticks for data in sent)
    ciphers = Ciphers(KEY, "seal")
    for n in (1, 2, 15):
        for octet in (0x00, 0xFF):
            body = bytes([1, 1, 255, n * 16 + octet % 2, 0x10 + n])
            inner = body + bytes([octet]) * (SIZE - 14 - len(body))
            data = delayed(ciphers.seal(inner, last), 1000)
            robot.hear(data, team.now)
    assert robot.link.report(robot.clock(team.now)).rx.pdus_dropped["rx_entry"] >= 3
    assert robot.link.audit() == []


def test_a_clear_pdu_that_comes_back_stays_readable():
    """The KEY record of a robot with another key, in a burst that was late."""
    other = Key(0, bytes(32))
    disk = Remembered({other.fingerprint: 0})
    team = Team(Robot(1, [KEY]), Robot(2, [other], disk=disk))
    outcomes = iter([Outcome.LATE, Outcome.SENT] * 1000)
    team.outcome = lambda: next(outcomes)
    team.run(12.0)
    clear = [data for _, _, data in team.on_air if not data[0] & 1]
    assert len(clear) >= 2
    for data in clear:
        (told,) = read_control_entries(parse(data, SIZE)).records
        assert isinstance(told, KeyTold)


@pytest.mark.slow
def test_a_disk_that_does_not_answer_stops_sealing_and_nothing_else():
    """Not even a burst that comes back, and would be made anew, breaks anything."""
    access = AccessParams(policy="tdma", nodes=[1, 2], slot_s=0.025, guard_s=0.002, reuse=False)
    team = Team(*(Robot(each, [KEY], access=access) for each in (1, 2)))
    team.run(3.0)
    robot = team.robots[1]
    robot.write = lambda _: None
    outcomes = iter([Outcome.LATE, Outcome.LATE, Outcome.SENT] * 100_000)
    team.outcome = lambda: next(outcomes)
    for _ in range(90):
        robot.link.submit(0, CDR, robot.clock(team.now))
        team.run(1.0)
    report = robot.link.report(robot.clock(team.now))
    assert "the disk does not take the numbers" in report.security.halted
    floor = robot.disk.floors[KEY.fingerprint]
    mine = [parse_sealed(data, SIZE).ticks for _, src, data in team.on_air if src == 1]
    assert max(mine) < floor
    assert robot.link.audit() == []
