"""`grant`: nobody clashes, everybody has a turn in time, and the team finds another root."""

from collections import defaultdict
from itertools import combinations, pairwise, product
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import ConfigError
from sdrlinkd.link import Qos, Sensed
from sdrlinkd.link.access import (
    Apart,
    Due,
    Grants,
    Ticks,
    Times,
    Waiting,
    Wish,
    make_access,
    places_of,
    plan,
    shares,
    stages,
    together,
    told,
    waiting_of,
    want_of,
)
from sdrlinkd.wire import ANYBODY, Frame, Grant, Want, build_records
from tests.laws import law, one_in
from tests.link.radios import params
from tests.link.schedules import FORMED_S, schedule_of
from tests.link.turns import LONGEST_S, PDU_S, ROOM, STEP_S, TRAITS, Team, tell, told_events

TIMES = Times(Ticks(1e-4, 2e-4), PDU_S, 0.02, LONGEST_S, 3e-4, 5e-4)
CHAIN = {(1, 2), (2, 3)}
TUNNEL = {(1, 2), (2, 3), (3, 4), (4, 5)}
BRIDGE = {(1, 2), (2, 3), (3, 4), (4, 5), (2, 5)}


def saturated(n, seed, **more):
    team = Team(list(range(1, n + 1)), seed, **more)
    for robot in team.robots.values():
        robot.bulk_s = 1e3
    return team


def with_urgent(team, node, begin_s, end_s, per_s=10.0):
    at = begin_s
    while (at := at + team.rng.expovariate(per_s)) < end_s:
        team.robots[node].urgent_at.append(at)


@pytest.mark.slow
@pytest.mark.parametrize(("n", "loss"), one_in(8, product([3, 2, 8, 12], [0.2, 0.0])))
def test_nobody_clashes_and_the_air_is_used(n, loss):
    team = saturated(n, seed=n, loss=loss)
    team.run(FORMED_S + 2)
    assert team.roots() == {1}
    assert team.clashes(FORMED_S) == []
    used_s = sum(each.end - each.begin for each in team.bursts if each.begin > FORMED_S)
    assert used_s > (0.75 if not loss else 0.5) * 2
    if not loss:
        assert {each.src for each in team.bursts} == set(team.robots)


@pytest.mark.slow
@pytest.mark.parametrize("n", one_in(3, [5, 9, 2]))
def test_whoever_has_something_urgent_waits_for_a_round_at_most(n):
    """All others have more bulk than the air carries."""
    team = saturated(n, seed=n)
    for node in team.robots:
        with_urgent(team, node, FORMED_S, FORMED_S + 4, per_s=3.0)
    team.run(FORMED_S + 5)
    round_s = team.robots[1].access.round_s
    assert len(team.waits_s) > 5 * n
    assert max(wait_s for _, _, wait_s in team.waits_s) <= round_s


@pytest.mark.long
@pytest.mark.parametrize("links", [CHAIN, BRIDGE], ids=["chain", "bridge"])
def test_robots_of_which_somebody_hears_both_never_send_at_once(links):
    nodes = {node for link in links for node in link}
    for seed in range(3):
        team = saturated(len(nodes), seed, links=links, loss=0.02)
        team.run(FORMED_S / 2)
        team.tell_links()
        team.run(2 * FORMED_S + 2)
        assert team.roots() == {2}, "nobody is farther than two hops from it"
        assert team.clashes(2 * FORMED_S) == []
        late = {each.src for each in team.bursts if each.begin > 2 * FORMED_S}
        assert late == nodes


@pytest.mark.long
def test_robots_that_are_three_hops_apart_send_at_once():
    far = {frozenset(pair) for pair in ((1, 4), (1, 5), (2, 5))}
    for seed in range(2):
        team = saturated(5, seed, links=TUNNEL, loss=0.02)
        team.run(FORMED_S / 2)
        team.tell_links()
        team.run(2 * FORMED_S + 4)
        since_s = 2 * FORMED_S + 2
        beside = list(team.beside(since_s))
        assert {frozenset((one.src, other.src)) for one, other in beside} <= far
        both_s = sum(min(one.end, other.end) - other.begin for one, other in beside)
        assert both_s > 0.2 * 2


nodes_of = st.integers(1, 9)


@law()
@given(
    st.lists(st.tuples(nodes_of, st.integers(1, 200)), max_size=10),
    st.lists(st.tuples(nodes_of, nodes_of), max_size=14),
    st.integers(0, 14),
    st.dictionaries(nodes_of, st.integers(1, 400)),
)
def test_turns_at_once_are_of_robots_of_which_nobody_hears_both(turns, links, most, uses):
    edges = {}
    for one, other in links:
        edges.setdefault(one, {})[other] = edges.setdefault(other, {})[one] = 1.0
    parents = places_of(1, edges).parents
    found = stages(turns, uses, Apart(edges), parents, TIMES.ticks, most)
    pairs = told(found, TIMES.ticks)
    assert len(pairs) <= max(most, len(turns))
    made = TIMES.ticks.round(0, 5.0, pairs).turns
    assert sorted(turn.node for turn in made) == sorted(node for node, _ in turns)
    alone = TIMES.ticks.round(0, 5.0, turns)
    assert TIMES.ticks.round(0, 5.0, pairs).end <= alone.end + 1e-9
    for node in {node for node, _ in turns}:
        n_ticks = sum(n for other, n in turns if other == node)
        assert sum(t.end - t.begin for t in made if t.node == node) >= (
            n_ticks * TIMES.ticks.tick_s - 1e-9
        )
    assert all(turn.begin >= 5.0 - 1e-9 for turn in made)
    for one, other in combinations(made, 2):
        if one.end + TIMES.ticks.guard_s <= other.begin + 1e-9:
            continue
        if other.end + TIMES.ticks.guard_s <= one.begin + 1e-9:
            continue
        near = [{node, *edges.get(node, ())} for node in (one.node, other.node)]
        assert {one.node, other.node} <= set(edges)
        assert near[0].isdisjoint(near[1])
    # Whoever heard of its turn in time still does.
    nodes = [node for node, _ in turns]
    first = {node: min(turn.begin for turn in made if turn.node == node) for node in nodes}
    for node, by in parents.items():
        if node in first and by in first and nodes.index(by) < nodes.index(node):
            assert first[by] < first[node]


@pytest.mark.long
def test_the_robot_in_the_middle_plans():
    for middle in (1, 2, 3):
        ends = [node for node in (1, 2, 3) if node != middle]
        team = Team([1, 2, 3], 5, links={(middle, end) for end in ends})
        team.run(2 * FORMED_S)
        assert team.roots() == {middle}


@pytest.mark.long
@pytest.mark.parametrize("loss", [0.1, 0.0])
def test_when_the_root_dies_another_plans_within_three_rounds(loss):
    for seed in range(4):
        team = saturated(5, seed, loss=loss)
        team.run(FORMED_S)
        team.robots[1].is_on = False
        died_s = team.t
        team.run(died_s + 1)
        round_s = team.robots[2].access.round_s
        planned = [each for each in team.bursts if each.begin > died_s + round_s and each.records]
        first = min(each.begin for each in planned)
        assert len(team.roots()) == 1
        if not loss:
            assert team.roots() == {2}
        assert first - died_s < 3 * round_s
        assert team.clashes(died_s + 4 * round_s) == []
        assert {each.src for each in team.bursts if each.begin > died_s + 0.5} == {2, 3, 4, 5}


@pytest.mark.long
def test_robots_join_without_a_clash_and_the_root_stays():
    for seed in range(4):
        team = saturated(4, seed, joins={1: 4.0, 3: 5.0})
        team.run(3.9)
        assert team.roots() == {2}
        team.run(9.0)
        assert team.roots() == {2}
        assert {each.src for each in team.bursts if each.begin > 8} == {1, 2, 3, 4}
        # Two robots that are not here yet may use the same turn for anybody.
        assert len(team.clashes(4.0)) <= 3


@pytest.mark.slow
def test_a_team_that_has_nothing_to_send_is_quiet():
    team = Team([1, 2, 3, 4], 1)
    team.run(FORMED_S + 2)
    late = [each for each in team.bursts if each.begin > FORMED_S]
    assert {each.src for each in late} == {1, 2, 3, 4}
    assert sum(each.src != 1 for each in late) < 4 * 4


@pytest.mark.long
def test_two_teams_that_meet_become_one():
    for seed in range(3):
        apart = {(1, 3), (2, 4)}
        team = saturated(4, seed, links=set(apart))
        team.run(FORMED_S)
        assert team.roots() == {1, 2}
        team.links |= {(1, 2), (1, 4), (2, 3), (3, 4)}
        team.run(FORMED_S + 6)
        assert team.roots() == {1}
        assert team.clashes(FORMED_S + 5) == []


@pytest.mark.slow
def test_a_plan_that_cannot_be_meant_is_refused():
    access = Team([1, 2], 1).robots[2].access
    good = Frame(1, 0, schedule_of((1, 2)), 0)
    for frame, grant in [
        (good, Grant(1, 1, 10**9, ((2, 10),))),
        (good, Grant(1, 1, 1000, ((2, 10), (255, 0), (2, 5)))),
        (good, Grant(1, 1, 1000, ((2, 255),) * 100)),
        (good._replace(schedule=good.schedule ^ 1), Grant(1, 1, 1000, ((2, 10),))),
        (good._replace(root=9), Grant(1, 1, 1000, ((2, 10),))),
    ]:
        access.take_frame(1, frame, 5.0)
        access.take_grant(1, grant, 5.0)
        assert access.turn_at(5.0) == 5.0, "it still listens"
        assert "listening" in access.state
    access.take_frame(1, good, 5.0)
    access.take_grant(1, Grant(1, 1, 1000, ((2, 10),)), 5.1)
    assert "listening" in access.state, "a GRANT of another burst"
    access.take_grant(1, Grant(1, 1, 1000, ((2, 10),)), 5.0)
    assert access.turn_at(5.0) == pytest.approx(5.001)
    assert "planned by robot 1" in access.state


def test_who_keeps_other_times_is_told_of():
    access, ours = Team([1, 2], 1).robots[2].access, schedule_of((1, 2))
    access.take_frame(1, Frame(1, 0, ours ^ 1, 0), 5.0)
    access.take_frame(9, Frame(9, 0, ours, 0), 5.0)
    notices = access.notices(6.0)
    assert len(notices) == 2
    assert "robot 9" in notices[0]
    assert "robot 1" in notices[1]


def test_own_id_must_be_listed():
    with pytest.raises(ConfigError, match=r"access\.nodes"):
        make_access(params("grant", [2, 3]), 1, TRAITS, LONGEST_S, Random(1))


waitings = st.builds(
    Waiting,
    st.sampled_from(Qos),
    st.integers(0, 127),
    st.floats(0, 10),
    st.floats(1e-4, 1.0),
    st.floats(0, 1.0),
).map(lambda each: each._replace(lower_air_s=0.0) if each.qos is Qos.BULK else each)
"""Nothing is lower than bulk."""


@law()
@given(st.dictionaries(st.integers(1, 12), waitings, max_size=9))
def test_what_is_urgent_for_anybody_comes_before_all_bulk(waiting):
    given_s = shares(TIMES, waiting, {})
    assert sum(given_s.values()) <= TIMES.budget_s + 1e-9
    classes = sorted({each.qos for each in waiting.values()})
    if classes and sum(given_s.values()) < TIMES.budget_s - 1e-9:
        return
    urgent = [node for node, each in waiting.items() if each.qos == min(classes, default=0)]
    needs_s = sum(waiting[node].air_s for node in urgent)
    has_s = sum(min(given_s.get(node, 0.0), waiting[node].air_s) for node in urgent)
    assert has_s >= min(needs_s, TIMES.budget_s) - 1e-9


@law()
@given(
    st.sets(st.integers(2, 20), min_size=1, max_size=12),
    st.dictionaries(st.integers(2, 20), waitings, max_size=8),
    st.dictionaries(st.integers(2, 20), st.floats(0, 9), max_size=12),
    st.lists(st.tuples(st.integers(1, 20), st.integers(1, 20)), max_size=30),
    st.booleans(),
)
def test_a_plan(present, waiting, served_at, links, is_open):
    """Turns do not overlap, fit the longest round, and come after that of who tells of them."""
    edges = {}
    for one, other in links:
        edges.setdefault(one, {})[other] = 1.0
        edges.setdefault(other, {})[one] = 1.0
    places = places_of(1, edges)
    waiting = {node: each for node, each in waiting.items() if node in present}
    turns = plan(
        TIMES,
        10.0,
        present,
        shares(TIMES, waiting, {}),
        places,
        served_at,
        is_open=is_open,
    )
    made = TIMES.ticks.round(1, 10.0, turns)
    assert all(
        after.begin >= turn.end + TIMES.ticks.guard_s - 1e-9 for turn, after in pairwise(made.turns)
    )
    assert {turn.node for turn in made.turns} <= {*present, ANYBODY}
    assert (ANYBODY in {turn.node for turn in made.turns}) == is_open
    first = {}
    for turn in made.turns:
        first.setdefault(turn.node, turn.begin)
    for node, begin in first.items():
        by = places.parents.get(node)
        if by in present:
            assert first[by] < begin
    old = {node for node in present if served_at.get(node, 0) < 9}
    if len(present) <= 8:
        assert old <= set(first), "who had no turn for long has one"


@pytest.mark.parametrize(("cost", "order"), [(50.0, [2, 4, 3, 5]), (200.0, [2, 3, 4, 5])])
def test_who_hears_the_plan_now_and_then_comes_before_robots_that_are_more_hops_away(cost, order):
    """Robot 4 has it from robot 1 sometimes, and then 3 may have it from 4. Usually, 3 tells 4."""
    links = {(1, 2): 1.0, (2, 3): 1.0, (3, 4): 1.0, (4, 5): 1.0, (1, 4): cost}
    edges = {}
    for (one, other), each in links.items():
        edges.setdefault(one, {})[other] = edges.setdefault(other, {})[one] = each
    turns = plan(TIMES, 10.0, [2, 3, 4, 5], {}, places_of(1, edges), {}, is_open=False)
    assert [node for node, _ in turns] == order


@law()
@given(waitings, st.floats(0, 3))
def test_what_is_sent_is_taken_off(waiting, sent_s):
    left = waiting.without(sent_s)
    if left is None:
        assert sent_s >= waiting.all_s - 1e-9
    else:
        assert left.all_s == pytest.approx(waiting.all_s - sent_s)
        assert left.qos >= waiting.qos


@law()
@given(waitings, waitings)
def test_two_requests_together(one, other):
    both = together(one, other)
    assert both.qos == min(one.qos, other.qos)
    assert both.all_s == pytest.approx(one.all_s + other.all_s)


@law()
@given(waitings)
def test_a_request_survives_the_air(waiting):
    told = waiting_of(want_of(3, waiting))
    assert (told.qos, told.priority) == (waiting.qos, waiting.priority)
    assert waiting.air_s <= told.air_s * (1 + 1e-9) <= max(6e-5, 1.1 * waiting.air_s)
    assert waiting_of(want_of(3, waiting)._replace(air=0, lower_air=0)) is None


@pytest.mark.long
@pytest.mark.parametrize("links", [None, {(1, node) for node in range(2, 13)} | {(2, 13)}])
def test_a_plan_fits_into_the_room_that_each_pdu_has(links):
    """Also when all want the most, and expect something urgent at once."""
    team = saturated(13, 3, links=links)
    team.run(FORMED_S)
    team.tell_links()
    team.run(FORMED_S + 1)
    robot = team.robots[1]
    now, spare = robot.clock(team.t), len(build_records([want_of(1, Waiting(Qos.BULK, 0, 1, 1))]))
    dues = tuple(Due(node, Qos.URGENT, now + 0.01, PDU_S) for node in range(2, 14))
    wish = Wish(now, Qos.BULK, PDU_S, Sensed(now, now), robot.waiting(team.t), dues)
    while robot.access.slot(wish) is None:
        now += 1e-3
        wish = wish._replace(earliest=now, sensed=Sensed(now, now))
    told = robot.access.told(now, PDU_S, Grants.least_room)
    assert len(told[1].turns) > 8
    assert len(build_records(told)) + spare <= Grants.least_room


@pytest.mark.slow
def test_requests_that_do_not_fit_beside_a_plan_wait_for_the_next_pdu():
    nodes, far = [*range(1, 10)], [*range(3, 10)]
    relay = make_access(params("grant", nodes), 2, TRAITS, LONGEST_S, Random(1))
    relay.know_links({1: {2: 1.0}, 2: dict.fromkeys([1, *far], 1.0)})
    relay.take_frame(1, Frame(1, 0, schedule_of(tuple(nodes)), 0), 5.0)
    relay.take_grant(1, Grant(1, 2, 1000, tuple((node, 10) for node in [2, *far])), 5.0)
    wants = [want_of(node, Waiting(Qos.BULK, 0, 0.0, 0.1)) for node in far]
    for want in wants:
        relay.take_want(want.node, want, 5.0)
    told = []
    while relay.must_tell:
        records = relay.told(5.001, PDU_S, Grants.least_room)
        assert len(build_records(records)) <= Grants.least_room
        told.append(records)
    assert isinstance(told[0][1], Grant)
    assert len(told) > 1
    assert [each for records in told for each in records if isinstance(each, Want)] == wants


@pytest.mark.long
@pytest.mark.parametrize("links", [None, CHAIN])
def test_no_round_is_longer_than_the_longest(links):
    for n in (3, 8, 12) if links is None else (3,):
        team = saturated(n, n, links=links)
        for node in team.robots:
            with_urgent(team, node, 0.0, 4.0, per_s=20.0)
        team.run(1.0)
        team.tell_links()
        team.run(5.0)
        root = team.robots[min(team.roots())]
        bursts = sorted(team.bursts)
        # A round begins with the first burst of the root's turn.
        begins = [
            each.begin
            for last, each in pairwise(bursts)
            if each.src == root.id != last.src and each.begin > FORMED_S
        ]
        assert len(begins) > 20
        assert max(b - a for a, b in pairwise(begins)) <= root.access.round_s


@pytest.mark.slow
def test_where_a_burst_has_a_single_pdu_the_root_sends_too():
    team = saturated(3, 2, traits=TRAITS._replace(longest_burst_s=(PDU_S,)))
    team.run(FORMED_S + 2)
    air_s = dict.fromkeys(team.robots, 0.0)
    for each in team.bursts:
        if each.begin > FORMED_S:
            air_s[each.src] += each.end - each.begin
    assert team.clashes(FORMED_S) == []
    assert min(air_s.values()) > 0.2 * 2


@pytest.mark.slow
@pytest.mark.parametrize(
    ("node", "every_s", "has_bulk"),
    one_in(5, product([1, 2], [0.001, 0.003, 0.01, 0.05], [False, True])),
)
def test_what_is_expected_starves_nobody(node, every_s, has_bulk):
    """Robot 3 may have bulk, robots 2 and 4 are quiet, and robot 5 may come at any time."""
    root = make_access(params("grant", [1, 2, 3, 4, 5]), 1, TRAITS, LONGEST_S, Random(1))
    now, turns_at, air_s = 0.0, defaultdict(list), 0.0
    while now < 6.0:
        for other in (2, 3, 4):
            root.heard(other, now, False)
        if has_bulk:
            root.take_want(3, want_of(3, Waiting(Qos.BULK, 0, 1.0, 1.0)), now)
        next_at = every_s * (1 + now // every_s)
        dues = tuple(
            Due(node, Qos.URGENT, next_at + n * every_s, PDU_S) for n in range(int(0.1 / every_s))
        )
        slot = root.slot(Wish(now, Qos.DEFAULT, PDU_S, Sensed(now, 0.0), None, dues))
        if slot is None:
            now += STEP_S
            continue
        _, grant = root.told(slot.start, PDU_S, Grants.least_room)
        root.sent(slot.start + PDU_S, None)
        begin = slot.start + 1e-6 * grant.begins_us
        for turn in TIMES.ticks.round(grant.number, begin, grant.turns).turns:
            turns_at[turn.node].append(turn.begin)
            air_s += (turn.end - turn.begin) * (turn.node == 3)
        now = max(now + STEP_S, root.turn_at(now))
    assert air_s > 0.3 * now * has_bulk
    for other in (2, 3, 4, ANYBODY):
        longest_s = max(b - a for a, b in pairwise([0.5, *turns_at[other], now]) if b > 0.5)
        assert longest_s <= 2 * root.round_s + 0.25 * (other == ANYBODY)


@pytest.mark.slow
@law()
@given(st.lists(told_events, max_size=40), st.integers(1, 3))
def test_whatever_is_told_turns_stay_within_bounds(events, own_id):
    access = make_access(params("grant", [1, 2, 3]), own_id, TRAITS, LONGEST_S, Random(1))
    now = 1.0
    for event in events:
        now += 0.003
        tell(access, event, schedule_of((1, 2, 3)), now, 0.003)
        waiting = Waiting(Qos.LATENCY, 64, 0.1, 0.002, 0.5)
        slot = access.slot(Wish(now, Qos.LATENCY, PDU_S, Sensed(now, now - 1.0), waiting))
        assert access.tells_at >= 0
        if slot is not None:
            assert now <= slot.start <= slot.end <= slot.start + 2 * access.round_s
            records = access.told(slot.start, PDU_S, ROOM)
            assert len(build_records(records)) <= ROOM
            access.sent(slot.start + PDU_S, None)
    assert access.state
    assert all(isinstance(each, str) for each in access.notices(now))


@pytest.mark.slow
def test_who_sends_in_no_turns_is_told_of():
    """Robot 3 sends at random, robot 2 in its turns, of which plans were not heard now and then."""
    team = Team([1, 2, 3], 4, loss=0.05, joins={3: 1e6})
    access = team.robots[1].access
    rng = Random(1)
    for i in range(400):
        team.run(FORMED_S + 0.01 * i)
        team.robots[2].bulk_s = 0.01
        if i > 100:
            access.heard(3, team.robots[1].clock(team.t) - rng.uniform(0, 0.01), False)
        if i == 100:
            assert access.notices(team.t) == []
    (notice,) = access.notices(team.t)
    assert notice.startswith("robot 3 sends outside of the turns that it is given")
    assert access.notices(team.t + 100.0) == []


def test_a_turn_for_anybody_is_shared_by_all_without_a_turn_in_the_same_round():
    """The root leaves a robot out of every second round. Robot 3 is new."""
    access = make_access(params("grant", [1, 2, 3]), 1, TRAITS, LONGEST_S, Random(1))
    now, used = 1.0, []
    for number in range(200):
        robot = ANYBODY if number % 2 else 1
        access.take_frame(2, Frame(2, 0, schedule_of((1, 2, 3)), 0), now)
        access.take_grant(2, Grant(number, 1, 1000, ((robot, 40),)), now)
        start = access.turn_at(now)
        slot = access.slot(Wish(start, Qos.DEFAULT, PDU_S, Sensed(start, now)))
        if robot == ANYBODY:
            used.append(slot is not None)
        now = start + 0.02
    assert 0.3 < sum(used) / len(used) < 0.7
