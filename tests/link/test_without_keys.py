"""What somebody without a key can do by forging or playing PDUs in the clear, and what not."""

from random import Random

import pytest

from sdrlinkd.link import (
    AccessParams,
    ClockParams,
    Outcome,
    PduLinkTraits,
    Qos,
    RateParams,
    Sensed,
    TopicPolicy,
)
from sdrlinkd.link.access import Wish, make_access
from sdrlinkd.wire import Beacon, Frame, LinkReport, PduBuilder, build_records, flags
from tests.link.radios import LOCKSTEP
from tests.link.steps import Steps
from tests.link.world import compose, make_link, neighbors, next_burst, rx, tell

COMMAND = b"\0\1\0\0" + bytes(48)
NEEDED_DB = (0.0, 3.0, 6.0, 9.0, 12.0, 15.0, 18.0, 21.0, 24.0, 27.0)


def commanded(**kinds):
    """(a robot that obeys commands of topic 0, its commander)"""
    robot, commander = make_link(2, **kinds), make_link(1, **kinds)
    robot.set_policy(0, TopicPolicy(qos="urgent", lifespan_s=0.3, deadman_s=0.5))
    return robot, commander


def send(commander, at, payload=COMMAND):
    commander.submit(0, payload, at)
    burst = compose(commander, at)
    commander.confirm(burst, Outcome.SENT, at)
    return burst.pdus


def test_a_recorded_command_is_not_obeyed_within_ten_seconds():
    robot, commander = commanded()
    (recorded,) = send(commander, 0.0)
    assert len(robot.hear(recorded, 0.001)) == 1
    for i in range(1, 200):
        # So many PDUs that the duplicate filter has forgotten it.
        (pdu,) = send(commander, 0.05 * i, b"\0\1\0\0" + i.to_bytes(4, "little"))
        assert len(robot.hear(pdu, 0.05 * i)) == 1
        assert robot.hear(recorded, 0.05 * i + 0.01) == []
    assert rx(robot).pdus_dropped["rx_dup"] == 199


def test_nor_after_a_forged_beacon_of_another_life():
    robot, commander = commanded()
    (recorded,) = send(commander, 0.0)
    robot.hear(recorded, 0.001)
    tell(robot, 1, Beacon(7, 0), at=0.1)
    for i in range(3):
        tell(robot, 1, Beacon(8, i), at=0.2 + 0.1 * i)
        assert robot.hear(recorded, 0.25 + 0.1 * i) == []


def test_the_same_command_again_is_another_one():
    robot, commander = commanded()
    for i in range(600):
        for pdu in send(commander, 0.0201 * i + 1e-6 * (i % 7)):
            assert len(robot.hear(pdu, 0.0201 * i + 0.001)) == 1


def test_a_command_is_obeyed_after_our_clock_has_begun_anew():
    robot, commander = commanded()
    for at in (500.0, 500.1):
        (pdu,) = send(commander, at, b"\0\1\0\0" + str(at).encode())
        assert len(robot.hear(pdu, at)) == 1
    for link in (robot, commander):
        link.attach(LOCKSTEP, AccessParams(policy="none"), RateParams())
    (pdu,) = send(commander, 0.1)
    assert len(robot.hear(pdu, 0.101)) == 1
    assert not robot.audit()


def test_another_boot_id_must_come_twice():
    link = make_link(2)
    tell(link, 1, Beacon(7, 0), at=0.0)
    tell(link, 1, Beacon(8, 0), at=1.0)
    assert neighbors(link)[1].reboots == 0
    tell(link, 1, Beacon(7, 1), at=1.5)
    tell(link, 1, Beacon(8, 1), at=2.0)
    assert neighbors(link)[1].reboots == 0
    tell(link, 1, Beacon(8, 2), at=3.0)
    assert neighbors(link)[1].reboots == 1


def forged(src, number, *records):
    builder = PduBuilder(1024)
    for record in records:
        assert builder.add_record(build_records([record]))
    return builder.build(flags(0), src, 255, number & 0xFF, 1, number >> 8)


def test_another_robot_with_our_id_is_a_notice_and_echoes_are_none():
    link, other = make_link(1), make_link(1, seed=9)
    for i in range(10):
        for pdu in send(link, 0.1 * i):
            link.hear(pdu, 0.1 * i + 0.01)
    assert not [text for text in link.notices(1.0) if "our id" in text]
    for i in range(3):
        for pdu in send(other, 1 + 0.1 * i, COMMAND + bytes([i])):
            link.hear(pdu, 1 + 0.1 * i)
    assert [text for text in link.notices(1.5) if "another robot sends with our id 1" in text]
    assert not [text for text in link.notices(30.0) if "our id" in text]


class Two(Steps):
    def arrivals(self, to, src, burst):
        for pdu in burst.pdus:
            yield 0.001, 20.0, pdu


def adaptive():
    """Two robots in contact, of which the first adapts its MCS."""
    links = {each: make_link(each, seed=each, clock=ClockParams(), beacon_s=1.0) for each in (1, 2)}
    traits = PduLinkTraits(
        needed_snr_db=NEEDED_DB, longest_burst_s=(0.1,) * 10, pdu_burst_s=(0.001,) * 10
    )
    for link in links.values():
        link.attach(traits, AccessParams(policy="none"), RateParams(adapt=True))
    team = Two(links, 0.01, next_burst, most_bursts=1)
    team.run(4.0)
    return team


def mcs_of_broadcasts(team):
    link = team.links[1]
    link.submit(0, COMMAND, team.now)
    return next_burst(link, team.now).mcs


def test_the_report_of_a_robot_that_does_not_exist_slows_nobody():
    team = adaptive()
    usual = mcs_of_broadcasts(team)
    assert usual >= 4
    for i in range(5):
        pdu = forged(77, i, LinkReport(1, -40, 255, 0), Beacon(3, i))
        team.links[1].hear(pdu, team.now + 0.01 * i, 30.0)
    assert mcs_of_broadcasts(team) == usual


def test_a_report_is_clamped_by_what_we_hear_ourselves():
    team = adaptive()
    report = LinkReport(1, -128, 0, 0)
    team.links[1].hear(forged(2, 999, report), team.now, 20.0)
    assert neighbors(team.links[1])[2].snr_there_db == pytest.approx(20.0 - 15.0, abs=0.5)


@pytest.mark.slow
def test_pretended_robots_do_not_silence_the_records_of_the_team():
    team = adaptive()

    def records_sent():
        return sum(src == 1 for _, src, _ in team.bursts)

    before = records_sent()
    team.run(team.now + 20.0)
    usual = records_sent() - before
    for i in range(20):
        for src in range(3, 255):
            team.links[1].hear(forged(src, i, Beacon(src, i)), team.now, 20.0)
        team.run(team.now + 1.0)
    flooded = records_sent() - before - usual
    assert flooded > usual / 4
    assert flooded >= 20


def tdma(own_id):
    params = AccessParams(policy="tdma", nodes=[1, 2, 3], slot_s=0.01, guard_s=0.001)
    traits = PduLinkTraits(
        longest_burst_s=(0.004,), pdu_burst_s=(0.002,), shares_air=True, senses=True
    )
    return make_access(params, own_id, traits, 0.004, Random(own_id))


def test_a_false_phase_moves_the_schedule_only_if_told_twice_in_a_row():
    root, follower = tdma(1), tdma(2)
    frame_s = 0.03
    # The root begins, and the follower follows it.
    root.slot(Wish(5.0, Qos.DEFAULT, 0.002, Sensed()))
    true = root.frame(6.0)
    follower.take_frame(1, true, 6.0)

    def off(at):
        told = 1e-6 * (follower.frame(at).phase_us - root.frame(at).phase_us)
        return abs((told + frame_s / 2) % frame_s - frame_s / 2)

    assert off(6.1) < 1e-5
    for i in range(20):
        at = 7.0 + i
        false = Frame(1, 0, true.schedule, 7_000)
        follower.take_frame(1, false, at + 0.5)
        assert off(at + 0.6) < 1e-5, "one false record moves nothing"
        follower.take_frame(1, root.frame(at + 0.7), at + 0.7)
    # A small change is followed at once, but by no more than half a guard time a frame.
    near = root.frame(30.0)
    follower.take_frame(1, near._replace(phase_us=near.phase_us + 400), 30.0)
    follower.take_frame(1, near._replace(phase_us=near.phase_us + 400 + 450), 30.001)
    assert off(30.01) < 0.5e-3 + 1e-5
    # A root that begins anew tells its phase again and again.
    follower.take_frame(1, root.frame(31.0), 31.0)
    for at in (32.0, 32.0 + 10 * frame_s):
        follower.take_frame(1, Frame(1, 0, true.schedule, 7_000), at)
    assert 1e-6 * follower.frame(at).phase_us == pytest.approx(0.007, abs=1e-5)
