"""Robots that have lost the numbers of their key: what they do, and how others help them."""

from random import Random

import pytest

from sdrlinkd.sealing import Remembered
from sdrlinkd.wire import (
    N_TICKS,
    TICKS_PER_S,
    FoundNumbers,
    LostNumbers,
    is_sealed,
    parse,
    parse_sealed,
    read_control_entries,
)
from tests.sealing.machine import Machine, in_pdu
from tests.sealing.team import KEY, NEW, NEXT, Robot, Team

CDR = b"\0\1\0\0"
LISTEN_S, DAY = 20.0, 86_400 * TICKS_PER_S
LAST_QUARTER = 3 * N_TICKS // 4
LOST = Remembered()


def report(team, robot_id):
    robot = team.robots[robot_id]
    return robot.link.report(robot.clock(team.now)).security


def sealed_by(team, robot_id):
    """(T, seq) of what a robot has sent sealed."""
    own = [parse_sealed(each, 128) for _, src, each in team.on_air if src == robot_id
           and is_sealed(each)]  # fmt: skip
    return [(pdu.ticks, pdu.seq) for pdu in own]


def tell_ages(team, age_s, *robots):
    for each in robots:
        robot = team.robots[each]
        robot.sealing.tell_ages({KEY.fingerprint: age_s}, robot.clock(team.now))


@pytest.fixture(scope="module")
def met():
    """The disks of two robots that have met, and what the first one has sent."""
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    team.run(3.0)
    disks = {each.id: each.sealing.memory.at_stop() for each in team.robots.values()}
    return disks, sealed_by(team, 1)


@pytest.mark.slow
def test_the_others_tell_what_they_have_heard(met):
    disks, before = met
    team = Team(Robot(1, [KEY], disk=LOST), Robot(2, [KEY], disk=disks[2]))
    for n in range(60):
        team.robots[1].link.submit(1, CDR + bytes([n]), team.robots[1].clock(team.now))
        team.run(0.5)
        if n == 30:
            assert not sealed_by(team, 1)
            assert "the other robots are asked for 5 more seconds" in report(team, 1).halted
            (notice,) = team.robots[2].link.notices(team.robots[2].clock(team.now))
            assert notice.startswith("robot 1 has lost the numbers of its key")
    after = sealed_by(team, 1)
    assert LAST_QUARTER + DAY < min(after)[0] < LAST_QUARTER + 26 * DAY
    assert not set(before) & set(after)
    assert report(team, 1).proven == [2]
    assert report(team, 2).proven == [1]
    assert report(team, 1).halted == ""
    assert len(team.robots[2].heard) > 15
    assert all(robot.link.audit() == [] for robot in team.robots.values())


@pytest.mark.slow
def test_a_clock_is_enough(met):
    """Its own, though nobody answers, or that of a robot that answers."""
    disks, _ = met
    for who in (1, 2):
        team = Team(Robot(1, [KEY], disk=LOST), Robot(2, [KEY], disk=disks[2]))
        if who == 1:
            team.hears = lambda receiver, _: receiver == 2
        age_s = 10 * 86_400.0
        tell_ages(team, age_s, who)
        team.run(LISTEN_S + 2)
        first = min(sealed_by(team, 1))[0] / DAY
        assert 4 + 12.5 < first < 4 + 12.5 + 0.001


@pytest.mark.slow
def test_ten_robots_from_one_image():
    """None of them has numbers. Without a clock none seals, and says so; with one, all go on."""
    robots = [Robot(each, [KEY], disk=LOST) for each in range(1, 11)]
    team = Team(*robots)
    team.run(LISTEN_S + 2)
    for robot in robots:
        assert not sealed_by(team, robot.id)
        words = report(team, robot.id).halted
        assert "no robot answers, and its age is not known" in words
        assert "sdrlinkctl key install --new" in words
        assert "make the next key: sdrlinkctl key rotate" in words
    # One of them gets a clock, and tells the others.
    tell_ages(team, 3600.0, 1)
    team.run(10.0)
    for robot in robots:
        assert len(set(sealed_by(team, robot.id))) == len(sealed_by(team, robot.id)) > 0
        assert len(report(team, robot.id).proven) == 9


def test_a_robot_that_nobody_has_heard_says_so():
    team = Team(Robot(1, [KEY], disk=LOST), Robot(2, [KEY]))
    team.run(LISTEN_S + 1)
    assert "no robot has heard this robot use it" in report(team, 1).halted
    # Somebody who knows better says that it is new.
    robot = team.robots[1]
    robot.sealing.install([KEY], NEW)
    team.run(2.0)
    assert report(team, 1).proven == [2]
    assert min(sealed_by(team, 1))[0] < 32


def test_who_only_receives_needs_no_numbers():
    """It never gets to send, so it never asks, and is not down."""
    receiver = Robot(1, [KEY], disk=LOST)
    team = Team(receiver, Robot(2, [KEY]))
    receiver.link.next_wakeup = lambda _: float("inf")
    team.run(LISTEN_S + 2)
    assert report(team, 1).halted == ""
    assert report(team, 1).not_proven == [2]


def test_who_changes_keys_while_numbers_are_lost_goes_on_with_the_next():
    floors = {NEXT.fingerprint: 0}
    team = Team(
        Robot(1, [KEY, NEXT], disk=Remembered(floors)), Robot(2, [KEY, NEXT])
    )  # fmt: skip
    team.run(3.0)
    robot = team.robots[1]
    robot.sealing.install([NEXT], Remembered(floors))
    team.run(2.0)
    assert report(team, 1).kid == 1
    assert sealed_by(team, 1)


def test_the_key_is_used_up_for_who_lost_its_numbers_too_late():
    team = Team(Robot(1, [KEY], disk=LOST), Robot(2, [KEY]))
    tell_ages(team, 310 * 86_400.0, 1)
    team.run(LISTEN_S + 2)
    assert "key 0 is used up" in report(team, 1).halted
    assert not sealed_by(team, 1)


def asking():
    """A robot that asks, and its question."""
    machine = Machine()
    machine.disk = LOST
    machine.restart([KEY])
    return machine, machine.sealing.told_in_clear(0.0)


def test_only_the_answer_to_the_own_question_counts():
    machine, asked = asking()
    resuming = machine.sealing.opener.resuming
    right = FoundNumbers(1, asked.number, 0, 5000, None)
    for wrong in (
        right._replace(number=bytes(7) + b"x"), right._replace(kid=1),
    ):  # fmt: skip
        resuming.answered(wrong, 1.0)
        assert resuming.floor(LISTEN_S + 1, None) is None
    resuming.answered(right, 1.0)
    resuming.answered(right._replace(newest=3000), 2.0)
    assert resuming.floor(LISTEN_S - 0.1, None) is None
    # Not twice at the same place, as nobody may hear what is sent from there.
    found = {resuming.floor(LISTEN_S + 1, None) for _ in range(50)}
    assert LAST_QUARTER + DAY <= min(found) < max(found) < LAST_QUARTER + 25 * DAY
    assert len(found) == 50
    resuming.answered(right._replace(newest=LAST_QUARTER + 20 * DAY), 3.0)
    assert resuming.floor(LISTEN_S + 1, None) >= LAST_QUARTER + 21 * DAY
    # Whoever is that far with a clock goes on from there, too.
    assert resuming.floor(LISTEN_S + 1, 3600.0) >= LAST_QUARTER + 21 * DAY


def test_the_oldest_age_counts():
    machine, asked = asking()
    resuming = machine.sealing.opener.resuming
    for age_s in (100.0, 90_000.0, 50.0):
        resuming.answered(FoundNumbers(1, asked.number, 0, 0, round(32 * age_s)), 1.0)
    told = resuming.floor(LISTEN_S + 1, 70_000.0)
    assert told == resuming.floor(LISTEN_S + 1, None) > resuming_floor_of(70_000.0)


def resuming_floor_of(age_s):
    machine, _ = asking()
    return machine.sealing.opener.resuming.floor(LISTEN_S + 1, age_s)


def test_a_flood_of_questions_leaves_room_for_others():
    """Four answers in half a second; whoever asks once a second among 20 is answered in a while."""
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    sealing, chance = team.robots[2].sealing, Random(3)
    honest = LostNumbers(0, KEY.fingerprint[:4], b"honestly")
    answered = told = 0
    for step in range(60):
        now = 1.0 + 0.5 * step
        asked = [(5, LostNumbers(0, KEY.fingerprint[:4], chance.randbytes(8))) for _ in range(10)]
        for src, lost in (*asked, *[(1, honest)] * (step % 2)):
            sealing.opener.refuses_clear(in_pdu(128, src, lost), now)
        found = sealing.found(now)
        assert len(found) <= 4
        told += len(found)
        answered += any(each.number == b"honestly" for each in found)
        assert sealing.found(now + 0.1) == []
    assert told == 240
    assert answered >= 3


def test_questions_about_other_keys_and_our_own_are_not_answered():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    sealing = team.robots[2].sealing
    for src, kid, key in ((1, 1, NEXT), (1, 0, NEXT), (2, 0, KEY)):
        lost = LostNumbers(kid, key.fingerprint[:4], bytes(8))
        assert sealing.opener.refuses_clear(in_pdu(128, src, lost), 1.0)
    assert sealing.found(2.0) == []


def test_recordings_of_ourselves_do_not_stop_who_has_lost_its_numbers(met):
    """They come with numbers that it does not know to have used."""
    disks, _ = met
    record = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    record.run(1.0)
    team = Team(Robot(1, [KEY], disk=LOST), Robot(2, [KEY], disk=disks[2]))
    tell_ages(team, 60.0, 1)
    own = [data for _, src, data in record.on_air if src == 1]
    for step in range(2 * round(LISTEN_S)):
        team.plays_at(1.0 + step, 1, own[step % len(own)])
    team.run(LISTEN_S + 3)
    assert report(team, 1).halted == ""
    assert report(team, 1).proven == [2]


def test_what_is_asked_is_in_the_clear_and_names_the_key():
    team = Team(Robot(1, [KEY], disk=LOST))
    team.run(4.5)
    records = [
        record
        for _, _, data in team.on_air
        for record in read_control_entries(parse(data, 128)).records
    ]
    assert len(records) == 5
    assert {(each.kid, each.fingerprint) for each in records} == {(0, KEY.fingerprint[:4])}
    assert len({each.number for each in records}) == 1


def test_copies_of_a_machine_are_told_apart():
    machines = {1: b"abcx", 2: b"abcy", 3: b"abcx", 4: b"defy"}
    team = Team(*(Robot(each, [KEY], machine=of) for each, of in machines.items()))
    team.run(2.0)

    def copies(robot_id):
        told = team.robots[robot_id].link.notices(team.robots[robot_id].clock(team.now))
        return [each.split()[1] for each in told if "has the machine id of this one" in each]

    assert [copies(each) for each in (1, 2, 3, 4)] == [["2"], ["1", "3"], ["2"], []]


def test_a_daemon_that_restarts_without_end_says_what_it_costs():
    machine = Machine()
    machine.age_s = 3600.0
    for _ in range(4000):
        machine.restart([KEY])
        machine.write()
    machine.send(1)
    machine.resume()
    (notice,) = machine.sealing.notices(machine.now)
    assert notice.startswith("the daemon was restarted so often that its numbers of key 0")


def test_with_another_clock_all_is_asked_anew():
    """What was known by the old one, such as the age of the key, is not known by this one."""
    machine, _ = asking()
    sealing = machine.sealing
    sealing.tell_ages({KEY.fingerprint: 5000.0}, 15.0)
    sealing.look(15.0)
    sealing.begin_anew()
    sealing.look(0.0)
    assert isinstance(sealing.told_in_clear(0.0), LostNumbers)
    sealing.look(LISTEN_S + 1)
    assert sealing.is_lost, "its age by the new clock is not known"
    sealing.tell_ages({KEY.fingerprint: 6000.0}, LISTEN_S + 2)
    sealing.look(LISTEN_S + 2)
    assert not sealing.is_lost


DAY_S = 86_400.0


def test_what_was_brought_from_the_key_before_counts():
    """T goes on under the next key, so the age of that one does not bound it alone."""
    machine = Machine()
    machine.disk = Remembered(
        {KEY.fingerprint: 100 * DAY, NEXT.fingerprint: 0}, {}, KEY.fingerprint
    )
    machine.restart([KEY, NEXT])
    machine.write()
    machine.do("send", 5)
    for seconds in (1.0, 700.0):
        machine.do("time", seconds)
        machine.write()
    machine.do("send", 100)
    newest = max(ticks for kid, ticks, _ in machine.used if kid == NEXT.kid)
    assert newest > 100 * DAY
    for is_answered in (False, True):
        machine.lose([NEXT], True, True, is_answered)
        machine.do("time", 25.0)
        machine.do("time", 25.0)
        machine.do("send", 100)
        assert min(t for kid, t, _ in machine.used if kid == NEXT.kid and t > newest) > newest + DAY


def test_who_restarts_soon_after_its_numbers_were_lost_waits_until_its_age_has_caught_up():
    """Else it would be where it begins if they are lost again."""
    machine = Machine()
    machine.age_s = 10 * DAY_S
    for _ in range(3):
        machine.lose([KEY], True, False, False)
        machine.do("time", 0.0)
        machine.do("time", 25.0)
        for seconds in (5.0, 3.0, 20.0):
            machine.do("send", 100)
            machine.do("time", seconds)
            machine.do("restart", [KEY])
            machine.do("time", 0.0)
        machine.do("send", 1)
        assert "the daemon has started again soon: it seals again in" in machine.sealing.halted
        machine.do("time", 500.0)
        before = len(machine.used)
        machine.do("send", 10)
        assert len(machine.used) == before + 10
        assert machine.sealing.halted == ""


@pytest.mark.parametrize("is_mended", [True, False])
def test_a_clock_that_was_set_back_makes_it_wait_until_it_is_right_or_not_trusted(is_mended):
    machine = Machine()
    machine.age_s = 10 * DAY_S
    machine.lose([KEY], True, False, False)
    machine.do("time", 0.0)
    machine.do("time", 25.0)
    machine.do("send", 10)
    machine.restart([KEY])
    machine.age_s -= 5 * DAY_S
    machine.do("time", 600.0)
    before = len(machine.used)
    machine.do("send", 10)
    assert len(machine.used) == before
    assert "it seals again in" in machine.sealing.halted
    machine.age_s += 5 * DAY_S * is_mended
    machine.is_synchronized = is_mended
    machine.do("time", 1.0)
    machine.do("send", 10)
    assert len(machine.used) == before + 10
    assert machine.sealing.halted == ""


def test_by_the_age_nobody_gets_into_the_last_quarter():
    machine, _ = asking()
    resuming = machine.sealing.opener.resuming
    assert resuming.floor(LISTEN_S + 1, 220 * DAY_S) < LAST_QUARTER
    assert resuming.floor(LISTEN_S + 1, 240 * DAY_S) == N_TICKS


def test_an_answer_that_comes_late_still_counts():
    """Others may have heard more than the age tells, as there was no clock once."""
    newest = LAST_QUARTER + 30 * DAY
    team = Team(
        Robot(1, [KEY], disk=LOST),
        Robot(2, [KEY], disk=Remembered({KEY.fingerprint: 0}, {KEY.fingerprint: {1: newest}})),
    )
    team.hears = lambda *_: False
    tell_ages(team, 3600.0, 1)
    team.run(LISTEN_S + 2)
    assert max(sealed_by(team, 1))[0] < 5 * DAY
    team.hears = lambda *_: True
    team.run(12.0)
    assert max(sealed_by(team, 1))[0] > newest + DAY
    assert report(team, 1).proven == [2]
    assert report(team, 2).proven == [1]


def test_what_is_added_while_the_disk_is_written_stays():
    machine = Machine()
    memory = machine.sealing.memory
    wanted = memory.wanted(0.0)
    machine.sealing.install([KEY, NEXT], Remembered({KEY.fingerprint: 0, NEXT.fingerprint: 777}))
    memory.written(wanted)
    assert memory.on_disk.floors[NEXT.fingerprint] == 777
    assert memory.on_disk.floors[KEY.fingerprint] == wanted.floors[KEY.fingerprint]
