"""The change from one key to the next, while messages flow."""

import pytest

from sdrlinkd.sealing.rotation import LONGEST_S, QUIET_S
from tests.sealing.team import KEY, NEXT, Robot, Team

CDR = b"\0\1\0\0"


def kid_in_use(robot, now):
    return robot.link.report(robot.clock(now)).security.kid


class Messages:
    """Each robot sends 100 messages a second."""

    def __init__(self, team):
        self.team, self.sent = team, 0

    def __call__(self, now):
        if round(now / 0.005) % 2:
            return
        self.sent += 1
        for robot in self.team.robots.values():
            robot.link.submit(1, CDR + self.sent.to_bytes(4, "big"), robot.clock(now))


@pytest.mark.parametrize("apart_s", [0.0, 7.0])
def test_none_lost_while_keys_change(apart_s):
    team = Team(*(Robot(each, [KEY]) for each in (1, 2, 3)))
    team.run(1.0)
    flow = Messages(team)
    team.run(2.0, flow)
    for robot in team.robots.values():
        assert kid_in_use(robot, team.now) == 0
        robot.sealing.install([KEY, NEXT])
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


def test_a_lost_robot_delays_the_others_for_a_limited_time_and_is_out_then():
    team = Team(*(Robot(each, [KEY]) for each in (1, 2, 3)))
    team.run(2.0)
    for each in (1, 2):
        team.robots[each].sealing.install([KEY, NEXT])
    team.run(LONGEST_S - 10.0)
    assert kid_in_use(team.robots[1], team.now) == 0
    team.run(20.0)
    assert kid_in_use(team.robots[1], team.now) == kid_in_use(team.robots[2], team.now) == 1
    team.run(LONGEST_S + 10.0)
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
        robot.keys = [KEY, NEXT]
        robot.sealing.install(robot.keys)
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
        robot.sealing.install([NEXT])
    team.run(2.0)
    assert kid_in_use(team.robots[1], team.now) == 1
    assert team.robots[1].link.report(team.robots[1].clock(team.now)).security.proven == [2]
