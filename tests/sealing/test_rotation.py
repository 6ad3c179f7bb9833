"""The change from one key to the next, while messages flow."""

import pytest

from sdrlinkd.sealing import Remembered
from sdrlinkd.sealing.testing import CONSTANTS, QUIET_S
from sdrlinkd.wire import N_TICKS, parse_sealed
from tests.sealing.team import KEY, NEXT, Robot, Team

CDR = b"\0\1\0\0"


def kid_in_use(robot, now):
    return robot.link.report(robot.clock(now)).security.kid


class Messages:
    """Each robot sends 20 messages a second."""

    def __init__(self, team):
        self.team, self.sent = team, 0

    def __call__(self, now):
        if round(now / 0.005) % 10:
            return
        self.sent += 1
        for robot in self.team.robots.values():
            robot.link.submit(1, CDR + self.sent.to_bytes(4, "big"), robot.clock(now))


@pytest.mark.long
@pytest.mark.parametrize("apart_s", [0.0, 7.0])
def test_none_lost_while_keys_change(apart_s):
    team = Team(*(Robot(each, [KEY]) for each in (1, 2, 3)))
    team.run(1.0)
    flow = Messages(team)
    team.run(2.0, flow)
    for robot in team.robots.values():
        assert kid_in_use(robot, team.now) == 0
        robot.install([KEY, NEXT])
        team.run(apart_s, flow)
    team.run(QUIET_S + 10.0, flow)
    for robot in team.robots.values():
        security = robot.link.report(robot.clock(team.now)).security
        assert (security.kid, security.further_kids) == (1, [])
        assert sorted(security.proven) == sorted(set(team.robots) - {robot.id})
    team.run(1.0)
    for robot in team.robots.values():
        for src in set(team.robots) - {robot.id}:
            heard = [each.payload for each in robot.heard if each.src == src]
            assert heard == [CDR + n.to_bytes(4, "big") for n in range(1, flow.sent + 1)]


@pytest.mark.long
def test_a_lost_robot_delays_the_others_for_a_limited_time_and_is_out_then(monkeypatch):
    longest_s = 60.0
    monkeypatch.setattr(*CONSTANTS["longest_s"], longest_s)
    team = Team(*(Robot(each, [KEY]) for each in (1, 2, 3)))
    team.run(2.0)
    for each in (1, 2):
        team.robots[each].install([KEY, NEXT])
    team.run(longest_s - 10.0)
    assert kid_in_use(team.robots[1], team.now) == 0
    team.run(20.0)
    assert kid_in_use(team.robots[1], team.now) == kid_in_use(team.robots[2], team.now) == 1
    team.run(longest_s + 10.0)
    heard = [len(team.robots[each].heard) for each in (1, 2)]
    lost = team.robots[3]
    for _ in range(10):
        lost.link.submit(0, CDR, lost.clock(team.now))
        team.run(0.1)
    assert [len(team.robots[each].heard) for each in (1, 2)] == heard
    team.robots[1].link.submit(0, CDR, team.robots[1].clock(team.now))
    team.run(0.5)
    assert len(team.robots[2].heard) == heard[1] + 1
    assert [each for each in lost.heard if each.at > team.now - 1] == []


def test_a_restart_goes_on_with_the_key_in_use():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    team.run(2.0)
    for robot in team.robots.values():
        robot.install([KEY, NEXT])
    team.run(10.0)
    assert kid_in_use(team.robots[1], team.now) == 1
    team.robots[1].start(team.now)
    assert kid_in_use(team.robots[1], team.now) == 1
    team.run(2.0)
    assert team.robots[2].link.report(team.robots[2].clock(team.now)).security.proven == [1]


def test_a_key_in_place_of_another_is_used_at_once():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    team.run(2.0)
    for robot in team.robots.values():
        robot.install([NEXT])
    team.run(2.0)
    assert kid_in_use(team.robots[1], team.now) == 1
    assert team.robots[1].link.report(team.robots[1].clock(team.now)).security.proven == [2]


@pytest.mark.slow
def test_a_key_that_was_replaced_does_not_open_after_a_restart_either():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    team.run(2.0)
    old = next(data for _, src, data in team.on_air if src == 2)
    for robot in team.robots.values():
        robot.install([KEY, NEXT])
    team.run(QUIET_S + 20.0)
    robot = team.robots[1]
    assert KEY.fingerprint in robot.disk.retired
    robot.start(team.now)
    robot.hear(old, team.now)
    report = robot.link.report(robot.clock(team.now))
    assert report.security.further_kids == []
    assert report.rx.pdus_dropped == {"sec_unknown_kid": 1}


@pytest.mark.slow
def test_the_next_key_has_a_life_of_its_own():
    """Its T begins at 0 where the old key has used more than half of its own."""
    begin = N_TICKS // 2 + 32 * 1000
    disk = Remembered({KEY.fingerprint: begin}, {}, KEY.fingerprint)
    team = Team(*(Robot(each, [KEY], disk=disk) for each in (1, 2)))
    team.run(2.0)
    flow = Messages(team)
    for robot in team.robots.values():
        robot.install([KEY, NEXT])
    team.run(20.0, flow)
    team.run(1.0)
    for robot in team.robots.values():
        security = robot.link.report(robot.clock(team.now)).security
        assert (security.kid, security.proven) == (1, [3 - robot.id])
        assert security.key_days_left > 388
        assert [each.payload for each in robot.heard] == [
            CDR + n.to_bytes(4, "big") for n in range(1, flow.sent + 1)
        ]


def test_a_key_that_comes_back_goes_on_behind_its_floor():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    robot = team.robots[1]
    robot.disk = robot.disk._replace(floors={**robot.disk.floors, NEXT.fingerprint: 32 * 5000})
    team.run(1.0)
    robot.install([NEXT])
    n = len(team.on_air)
    team.run(2.0)
    used = [parse_sealed(data, 128) for _, src, data in team.on_air[n:] if src == 1]
    assert used
    assert all(pdu.ticks >= 32 * 5000 for pdu in used if pdu.kid == NEXT.kid)


def test_a_recording_of_our_own_under_the_key_before_does_not_stop_us():
    begin = N_TICKS // 2 + 32 * 1000
    disk = Remembered({KEY.fingerprint: begin}, {}, KEY.fingerprint)
    team = Team(*(Robot(each, [KEY], disk=disk) for each in (1, 2)))
    team.run(3.0)
    own = [data for _, src, data in team.on_air if src == 1]
    for robot in team.robots.values():
        robot.install([KEY, NEXT])
    team.run(5.0)
    robot = team.robots[1]
    assert kid_in_use(robot, team.now) == 1
    for data in own:
        robot.hear(data, team.now)
    assert robot.link.report(robot.clock(team.now)).security.halted == ""
