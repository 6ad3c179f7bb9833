"""Teams that hear each other too weakly to read it, with the policy `grant`."""

from itertools import combinations, pairwise

import pytest

from sdrlinkd.link import RateParams
from sdrlinkd.wire import ANYBODY, BROADCAST, Frame, Grant, PduBuilder, build_records, flags
from tests.link.radios import params
from tests.link.schedules import schedule_of
from tests.link.turns import PDU_S, ROOM, TRAITS, Team
from tests.link.world import make_link

TWO_TEAMS = [*combinations((1, 2, 3), 2), *combinations((4, 5, 6), 2)]


def busy(*args, **kinds):
    """A team of which everybody has bulk to send all the time."""
    team = Team(*args, **kinds)
    team.tell_links()
    for robot in team.robots.values():
        robot.bulk_s = 1e6
    return team


def longest_silence_s(team, node, since_s):
    begins = [since_s, *(b.begin for b in team.bursts if b.src == node and b.begin > since_s)]
    return max(after - before for before, after in pairwise([*begins, team.t]))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_plans_that_are_read_by_luck_silence_nobody(seed):
    """Robot 1 would be the better root for robots 4 to 6, if only they heard its plans."""
    team = busy(range(1, 7), seed, links=TWO_TEAMS, weak=[(3, 4), (2, 4), (1, 4)])
    team.run(12.0)
    for node in team.robots:
        assert longest_silence_s(team, node, 6.0) < 0.5


@pytest.mark.long
def test_a_root_that_is_gone_is_replaced_though_the_air_is_never_silent():
    """The others cannot read robots 4 and 5, and hear them all the time."""
    weak = [(a, b) for a in (2, 3) for b in (4, 5)]
    team = busy(range(1, 6), 1, links=[(1, 2), (1, 3), (2, 3), (4, 5)], weak=weak)
    team.run(6.0)
    team.robots[1].is_on = False
    team.run(8.0)
    assert longest_silence_s(team, 2, 7.0) < 0.5
    assert longest_silence_s(team, 3, 7.0) < 0.5


@pytest.mark.slow
@pytest.mark.parametrize(("teller", "planner"), [(2, 4), (3, 1)])
def test_who_told_the_plans_of_a_root_is_followed_to_another_one(teller, planner):
    """Robot 2 tells no more of root 1, as it follows root 4, though that one is farther away."""
    access = Team(range(1, 6), 1).robots[5].access
    for src, root, reach, at in [(2, 1, 1, 5.0), (teller, 4, 3, 5.05)]:
        access.take_frame(src, Frame(root, 1, schedule_of(range(1, 6)), 0), at)
        access.take_grant(src, Grant(1, reach, 1000, ((5, 10),)), at)
    assert f"planned by robot {planner}, 2 hops away" in access.state


@pytest.mark.slow
def test_over_a_link_that_loses_some_bursts_a_team_forms_all_the_same():
    team = Team((1, 2), 1, links=[], weak=[(1, 2)], luck=0.8)
    team.run(8.0)
    assert team.roots() == {1}


@pytest.mark.slow
def test_robots_that_no_path_leads_to_do_not_count():
    """LSAs of robots that have gone are kept for a while. The robot in the middle plans."""
    team = Team(range(1, 6), 1, links=[(1, 2), (2, 3), (4, 5)])
    team.tell_links()
    team.run(4.0)
    assert team.roots() == {2, 4}
    middle = team.robots[2]
    _, plan = middle.access.told(middle.clock(team.t), PDU_S, ROOM)
    assert {node for node, _ in plan.turns} <= {1, 3, ANYBODY}


@pytest.mark.parametrize(("snr_db", "doing"), [(4.9, "listening"), (5.0, "planned by robot 2")])
def test_the_snr_tells_whether_a_signal_is_weak(snr_db, doing):
    """It is if it is more than 1 dB below what PDUs need."""
    link = make_link(1, pdu_size=256)
    link.attach(TRAITS._replace(needed_snr_db=(6.0,)), params("grant", (1, 2)), RateParams())
    builder = PduBuilder(256)
    records = [Frame(2, 0, schedule_of((1, 2)), 0), Grant(1, 1, 1000, ((1, 10),))]
    assert builder.add_record(build_records(records))
    link.hear(builder.build(flags(0), 2, BROADCAST, 1, link.params.hop_limit, 0), 0.5, snr_db)
    assert doing in link.report(0.5).access
