"""First contact: who is believed, how soon, and by whom never."""

import struct

import pytest

from sdrlinkd.link import AccessParams, RelayParams
from sdrlinkd.sealing import Remembered, SecurityParams, words_of
from tests.sealing.team import KEY, NEXT, Robot, Team

CDR = b"\0\1\0\0"


def security(team, robot_id):
    robot = team.robots[robot_id]
    return robot.link.report(robot.clock(team.now)).security


def notices(team, robot_id):
    robot = team.robots[robot_id]
    return robot.link.notices(robot.clock(team.now))


def dropped(team, robot_id):
    robot = team.robots[robot_id]
    return robot.link.report(robot.clock(team.now)).rx.pdus_dropped


def send(team, robot_id, payload=b"", topic_id=1):
    robot = team.robots[robot_id]
    assert robot.link.submit(topic_id, CDR + payload, robot.clock(team.now)) is None


def test_two_robots_prove_each_other_within_a_second():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    team.run(1.0)
    for robot in team.robots.values():
        assert security(team, robot.id).proven == [3 - robot.id]
        assert robot.link.audit() == []


def test_what_is_sent_before_the_proof_waits_and_comes_in_order():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    for number in range(5):
        send(team, 1, bytes([number]))
    team.run(0.005)
    assert team.robots[2].heard == []
    team.run(1.0)
    assert [each.payload[4:] for each in team.robots[2].heard] == [bytes([n]) for n in range(5)]
    assert all(each.age_s is not None for each in team.robots[2].heard)


def test_who_never_hears_us_is_never_believed():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]), hears=lambda receiver, _: receiver == 2)
    for _ in range(20):
        send(team, 1)
        team.run(0.5)
    assert team.robots[2].heard == []
    assert security(team, 2).not_proven == [1]
    assert dropped(team, 2)["sec_unproven"] > 15
    assert team.robots[2].link.audit() == []


@pytest.mark.parametrize("of_topic", [False, True])
def test_a_station_that_only_receives_can_take_all(of_topic):
    params = SecurityParams(mode="seal", unproven="drop" if of_topic else "deliver")
    team = Team(Robot(1, [KEY]), Robot(2, [KEY], params), hears=lambda receiver, _: receiver == 2)
    link = team.robots[2].link
    if of_topic:
        policy = link.policy(1)
        link.set_policy(1, type(policy)(unproven="deliver"))
    for _ in range(20):
        send(team, 1)
        send(team, 1, topic_id=0)
        team.run(0.1)
    topics = 1 if of_topic else 2
    assert len(team.robots[2].heard) == 20 * topics
    received = link.report(0.0).received
    assert sum(each.dropped.get("rx_unproven", 0) for each in received) == 20 * (2 - topics)
    assert link.audit() == []


@pytest.mark.slow
def test_five_robots_with_tdma_start_cold():
    access = AccessParams(
        policy="tdma", nodes=[1, 2, 3, 4, 5], slot_s=0.025, guard_s=0.002, minislot_s=0.0
    )
    team = Team(*(Robot(each, [KEY], access=access) for each in range(1, 6)))
    team.run(10.0)
    for each in range(1, 6):
        assert security(team, each).proven == [other for other in range(1, 6) if other != each]


@pytest.mark.slow
def test_a_chain_of_three():
    relay = RelayParams(policy="flood")
    robots = [Robot(each, [KEY], relay=relay, hop_limit=3) for each in (1, 2, 3)]
    team = Team(*robots, hears=lambda a, b: abs(a - b) == 1)
    team.run(3.0)
    assert security(team, 3).proven == [1, 2]
    for number in range(100):
        send(team, 1, bytes([number]), topic_id=0)
        team.run(0.05)
    assert [each.payload[4] for each in team.robots[3].heard] == list(range(100))
    assert max(each.age_s for each in team.robots[3].heard) < 0.05


def test_two_robots_with_different_keys_say_so_within_5_s():
    team = Team(Robot(1, [KEY]), Robot(2, [other(NEXT)]))
    team.run(5.0)
    for each in (1, 2):
        (notice,) = [n for n in notices(team, each) if "another key 0" in n]
        assert f"robot {3 - each} is heard, but uses another key 0" in notice
        assert words_of(other(NEXT).fingerprint[:4]) in notice
        assert words_of(KEY.fingerprint[:4]) in notice
    assert dropped(team, 1)["sec_bad_tag"] > 0
    assert dropped(team, 1)["sec_cleartext"] == 1


def other(key):
    """The same key under kid 0."""
    return type(key)(0, key.secret)


def test_a_key_that_is_not_installed():
    team = Team(Robot(1, [KEY]), Robot(2, [NEXT]))
    team.run(5.0)
    assert any("uses another key 1" in each and "ours: none" in each for each in notices(team, 1))
    assert dropped(team, 1)["sec_unknown_kid"] > 0


def test_one_key_in_two_modes():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY], SecurityParams(mode="auth")))
    team.run(5.0)
    assert any(
        "uses the mode auth" in each and "security.mode" in each for each in notices(team, 1)
    )
    assert any(
        "uses the mode seal" in each and "security.mode" in each for each in notices(team, 2)
    )


def test_a_robot_without_a_key():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY], SecurityParams()))
    send(team, 2)
    team.run(3.0)
    assert team.robots[1].heard == team.robots[2].heard == []
    assert any("robot 2 is heard, but sends in the clear" in each for each in notices(team, 1))
    assert any("robot 1 is heard, but seals its PDUs" in n for n in notices(team, 2))
    assert dropped(team, 1)["sec_cleartext"] > 0
    assert dropped(team, 2)["rx_flags"] > 0


def test_clear_is_accepted_on_request_but_not_from_who_sealed_once():
    accepts = SecurityParams(mode="seal", clear="accept")
    team = Team(Robot(1, [KEY], accepts), Robot(2, [KEY], SecurityParams()), Robot(3, [KEY]))
    team.run(1.0)
    send(team, 2)
    send(team, 3)
    team.run(0.5)
    heard = {each.src: each.is_sealed for each in team.robots[1].heard}
    assert heard == {2: False, 3: True}
    # Robot 3 begins to send in the clear, or somebody does in its name.
    for is_new_life in (False, True):
        if is_new_life:
            team.robots[1].start(team.now)
        team.robots[3].params = SecurityParams()
        team.robots[3].start(team.now)
        heard = len([each for each in team.robots[1].heard if each.src == 3])
        send(team, 3)
        team.run(1.0)
        assert len([each for each in team.robots[1].heard if each.src == 3]) == heard
        # What is on disk says so, too, in the next life.
        team.robots[1].disk = team.robots[1].sealing.memory.at_stop()


@pytest.mark.slow
def test_another_robot_with_our_id_and_key_stops_us():
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    team.run(40.0)
    double = Robot(1, [KEY])
    clone = Team(double)
    clone.run(1.0)
    old_life = clone.on_air[0][2]
    # It is older than our start, so it may be a recording of ourselves.
    team.robots[1].hear(old_life, team.now)
    assert security(team, 1).halted == ""
    # As after a minute of use.
    double.disk = Remembered({KEY.fingerprint: 32 * 60}, {}, KEY.fingerprint)
    double.start(clone.now)
    clone.run(12.0)
    team.robots[1].hear(clone.on_air[-1][2], team.now)
    assert "another robot has our id 1 and our key" in security(team, 1).halted
    n = len(team.on_air)
    team.run(2.0)
    assert [src for _, src, _ in team.on_air[n:] if src == 1] == []
    team.robots[1].start(team.now)
    team.run(0.5)
    assert security(team, 1).halted == ""


@pytest.mark.slow
@pytest.mark.parametrize("off_s", [15.0, 25.0, 70.0])
def test_after_an_outage_one_way_messages_come_again_at_once(off_s):
    """The receiver has to ask for a proof again, and the sender does not know."""
    team = Team(Robot(1, [KEY]), Robot(2, [KEY]))
    team.run(3.0)
    team.tamper = lambda receiver, _: receiver != 2
    team.run(off_s)
    team.tamper = lambda *_: True
    back_at, sent = team.now, 0
    for _ in range(200):
        sent += 1
        send(team, 1, sent.to_bytes(2, "big"))
        team.run(0.05)
    assert [each.payload[4:] for each in team.robots[2].heard] == [
        n.to_bytes(2, "big") for n in range(1, sent + 1)
    ]
    assert team.robots[2].heard[0].at - back_at < 2.0


@pytest.mark.long
@pytest.mark.parametrize(("pdu_size", "robots"), [(46, 8), (64, 16)])
def test_many_robots_in_small_pdus_stay_proven(pdu_size, robots):
    team = Team(*(Robot(each, [KEY], pdu_size=pdu_size) for each in range(1, robots + 1)))
    team.run(20.0)
    before = [dropped(team, each).get("sec_unproven", 0) for each in team.robots]
    for _ in range(35):
        team.run(2.0)
        for robot in team.robots.values():
            assert len(security(team, robot.id).proven) == robots - 1
    assert [dropped(team, each).get("sec_unproven", 0) for each in team.robots] == before


@pytest.mark.slow
def test_drift_of_hours_gains_nothing():
    """One direction is jammed; the other is delayed by as much as the clocks drift apart."""
    team = Team(Robot(1, [KEY], drift=2e-4), Robot(2, [KEY], drift=-2e-4))
    team.run(3.0)
    began = team.now

    def tamper(receiver, data):
        if receiver == 2:
            team.plays_at(team.now + 4e-4 * (team.now - began), 2, data)
        return False

    team.tamper = tamper
    for _ in range(20):
        team.run(40.0)
        send(team, 1, struct.pack(">d", team.now), topic_id=0)
        team.run(1.0)
    for each in team.robots[2].heard:
        (sent_at,) = struct.unpack(">d", each.payload[4:])
        assert each.age_s >= each.at - sent_at - 0.135
