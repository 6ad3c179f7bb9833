"""Who always wants urgent gets a share, keeps nobody from the air, and is named."""

from collections import Counter
from itertools import pairwise
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import Qos
from sdrlinkd.link.access import Ticks, Times, Waiting, account, shares
from tests.laws import law, one_in
from tests.link.pulsing import FAST, PulsingAir
from tests.link.turns import LONGEST_S, PDU_S, Team

BURST_S, SHORT_S = 0.004, 0.0005
SETTLED_S, FORMED_S = 1.5, 3.0
TIMES = Times(Ticks(1e-4, 2e-4), PDU_S, 0.02, LONGEST_S, 3e-4, 5e-4)


def auction(n, seed=1, quiet=()):
    """Robots that have bulk, except those that are `quiet`."""
    ppm = {node: Random(100 * seed + node).uniform(-20, 20) for node in range(n)}
    air = PulsingAir(n, seed, ppm=ppm)
    for node in {*range(n)} - {*quiet}:
        for _ in range(5000 // n):
            air.offer(node, 0.0, Qos.BULK)
    return air


def always(air, nodes, begin_s, end_s):
    """More urgent messages than the air carries, at any time."""
    for node in nodes:
        for i in range(round((end_s - begin_s) / BURST_S)):
            air.offer(node, begin_s + i * BURST_S, Qos.URGENT)


def once_a_while(air, node, begin_s, until_s):
    at = begin_s
    while (at := at + air.rng.uniform(0.1, 0.2)) < until_s:
        air.offer(node, at, Qos.URGENT, SHORT_S)


def urgent_air_s(air, since):
    used_s = Counter()
    for each in air.bursts:
        if each.qos is Qos.URGENT and each.begin > since:
            used_s[each.src] += each.end - each.begin
    return used_s


@pytest.mark.slow
@pytest.mark.parametrize("has_bulk", one_in(2, [True, False]))
@pytest.mark.parametrize("chatty", [(0, 1, 2), pytest.param((0,), marks=pytest.mark.long)])
def test_in_an_auction_nobody_who_always_has_something_urgent_goes_twice_before_another(
    chatty, has_bulk
):
    """If its robot has bulk as well, the others know that of it, and not the urgent message."""
    n, one, until_s = 8, 7, SETTLED_S + 5
    air = auction(n, quiet=() if has_bulk else (one,))
    always(air, chatty, SETTLED_S, until_s)
    # It is known after a second.
    once_a_while(air, one, SETTLED_S + 1, until_s)
    air.run(until_s)
    air.assert_nobody_clashes()
    waits = [each.begin - each.arrived_at for each in air.bursts
             if each.src == one and each.qos is Qos.URGENT]  # fmt: skip
    access = air.nodes[0].access
    assert len(waits) > 20
    turn_s = BURST_S + access.pause_s
    # The burst that goes on, one of each that has not had one since, and a contest.
    bound_s = len(chatty) * turn_s + access.pause_s + access.round_s + 2 * FAST.react_s
    assert max(waits) <= bound_s


@pytest.mark.slow
def test_in_an_auction_those_who_always_want_urgent_share_what_is_left():
    air, chatty = auction(6), (0, 2, 5)
    always(air, chatty, SETTLED_S, SETTLED_S + 3)
    air.run(SETTLED_S + 3)
    used_s = urgent_air_s(air, SETTLED_S)
    assert sum(used_s.values()) > 0.95 * 3 * air.nodes[0].access.carries(BURST_S)
    assert max(used_s.values()) < 1.05 * min(used_s[node] for node in chatty)


waitings = st.builds(
    Waiting, st.sampled_from(Qos), st.sampled_from([64, 100]), st.floats(0, 10),
    st.floats(1e-3, 0.1),
)  # fmt: skip


@law()
@given(
    st.dictionaries(st.integers(1, 6), waitings, max_size=6),
    st.dictionaries(
        st.builds(account, st.integers(1, 6), st.sampled_from(Qos)), st.floats(0, 1)
    ),
)  # fmt: skip
def test_of_those_with_the_same_class_the_robot_comes_first_that_had_the_least(waiting, had_s):
    given_s = shares(TIMES, waiting, had_s)
    ranks = [
        (waiting[node].qos, -waiting[node].priority,
         had_s.get(account(node, waiting[node].qos), 0.0))
        for node in given_s
    ]  # fmt: skip
    assert ranks == sorted(ranks)
    refused = waiting.keys() - given_s.keys()
    assert not refused or sum(given_s.values()) > TIMES.budget_s - 1e-9, "what is left is given"


def team_of(n, chatty, begin_s, end_s):
    """All have bulk; some have more urgent messages than the air carries. These began earlier."""
    team = Team(list(range(1, n + 1)), 3)
    for robot in team.robots.values():
        robot.bulk_s = 1e3
    for node in chatty:
        n_urgent = round((end_s - begin_s) / PDU_S)
        team.robots[node].urgent_at = [begin_s + i * PDU_S for i in range(n_urgent)]
    return team


def turns_s(team, since):
    """Airtime of each robot beyond what it has in its least turns."""
    used_s = Counter()
    for each in team.bursts:
        if each.begin > since and each.end - each.begin > 1.5 * PDU_S:
            used_s[each.src] += each.end - each.begin
    return used_s


@pytest.mark.long
@pytest.mark.parametrize("root_too", [False, True])
def test_with_turns_those_who_always_want_urgent_share_the_air(root_too):
    chatty = (1, 2, 4) if root_too else (2, 4, 5)
    team = team_of(6, chatty, FORMED_S, FORMED_S + 8)
    # The one that began first has the oldest messages, as long as it is not served.
    team.robots[2].urgent_at[:0] = [FORMED_S / 2] * 2000
    team.run(FORMED_S + 4)
    used_s = turns_s(team, FORMED_S + 1)
    assert team.clashes(FORMED_S) == []
    assert sum(used_s[node] for node in chatty) > 0.6 * 3
    assert max(used_s[node] for node in chatty) < 1.3 * min(used_s[node] for node in chatty)


@pytest.mark.long
def test_with_turns_an_urgent_message_now_and_then_goes_before_those_that_always_come():
    """It takes eight PDUs, so it does not fit a least turn. The others still have theirs."""
    team, one, n = team_of(6, (2, 4), FORMED_S, FORMED_S + 8), 6, 8
    came_at = [FORMED_S + 1 + 0.37 * i for i in range(8)]
    team.robots[one].urgent_at = [at for at in came_at for _ in range(n)]
    team.run(FORMED_S + 5)
    round_s = team.robots[1].access.round_s
    waits = [wait_s for node, _, wait_s in team.waits_s if node == one]
    assert len(waits) == n * len(came_at)
    # It is asked for in one round, and given in the next.
    assert max(waits) < 2 * round_s
    for node in (1, 3, 5):
        begins = [each.begin for each in team.bursts if each.src == node]
        assert max(b - a for a, b in pairwise(begins)
                   if a > FORMED_S) < 2 * round_s  # fmt: skip


def named(access, now):
    return {text.split(" has wanted urgent")[0] for text in access.notices(now)
            if " has wanted urgent" in text}  # fmt: skip


@pytest.mark.long
def test_in_an_auction_it_is_named_until_it_stops():
    air, end_s = auction(4), SETTLED_S + 12
    always(air, [2], SETTLED_S, end_s)
    once_a_while(air, 1, SETTLED_S, end_s)
    for until_s, is_named in ((SETTLED_S + 8, False), (end_s - 0.5, True), (end_s + 4, False)):
        air.run(until_s)
        if until_s > end_s - 1:
            air.nodes[2].waiting = [each for each in air.nodes[2].waiting if each.qos is Qos.BULK]
        for node in air.nodes.values():
            who = "this robot" if node.id == 2 else "robot 2"
            assert named(node.access, node.clock(until_s)) == ({who} if is_named else set())
    # If nothing is heard any more, nothing is known.
    always(air, [2], end_s + 4, end_s + 16)
    air.run(end_s + 16)
    access = air.nodes[0].access
    assert named(access, end_s + 16) == {"robot 2"}
    assert named(access, end_s + 30) == set()


@pytest.mark.long
@pytest.mark.parametrize("who", [1, 3])
def test_with_turns_it_is_named_until_it_stops(who):
    """Robot 1 plans. It tells no requests, so the others do not know its own."""
    team, end_s = team_of(4, [who], FORMED_S, FORMED_S + 12), FORMED_S + 12
    team.robots[2].urgent_at = [FORMED_S + 0.2 * i for i in range(60)]
    for until_s, is_named in ((FORMED_S + 8, False), (end_s, True), (end_s + 10, False)):
        team.run(until_s)
        if until_s == end_s:
            team.robots[who].urgent_at = []
        for node, robot in team.robots.items():
            told = "this robot" if node == who else f"robot {who}"
            expected = is_named and (who != 1 or node == who)
            assert named(robot.access, robot.clock(until_s)) == ({told} if expected else set())
