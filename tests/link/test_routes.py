"""Routes that a team finds itself: over several hops, around robots that fail, and no others."""

from itertools import combinations, pairwise
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import ClockParams, Overrides
from sdrlinkd.link.routes import path, tree
from sdrlinkd.wire import BROADCAST, Lsa, Need, Route, parse
from tests.laws import law, one_in
from tests.link.lossy import carries
from tests.link.meshes import AUTO, both, flows, isolate, mesh, of_others
from tests.link.world import compose, make_link, rx, tell

DIAMOND = ((1, 2), (1, 3), (2, 4), (3, 4))
PERIOD_S = 0.02


@pytest.mark.slow
@pytest.mark.parametrize("dst", one_in(2, [4, BROADCAST]))
def test_a_chain_is_found_and_ages_stay_true(dst):
    air = mesh((1, 2), (2, 3), (3, 4))
    air.run(2.0)
    air.flow(1, 50, overrides=Overrides(dst=dst))
    air.flow(4, 50, first=100, overrides=Overrides(dst=1 if dst == 4 else dst))
    air.run(air.now + 0.5)
    assert [n for n in air.numbers(4) if n < 100] == list(range(50))
    assert [n for n in air.numbers(1) if n >= 100] == list(range(100, 150))
    for _, _, age_s, told_s in air.got:
        assert told_s == pytest.approx(age_s, abs=3e-3)
    assert flows(air, 1)[1, BROADCAST] == [2]
    assert flows(air, 2)[1, BROADCAST] == [3]
    assert (1, BROADCAST) not in flows(air, 3)


@pytest.mark.long
def test_where_all_hear_all_nothing_is_relayed_and_little_is_told():
    air = mesh(*combinations(range(1, 7), 2))
    air.run(3.0)
    air.flow(1, 100)
    air.run(20.0)
    assert air.numbers(6) == list(range(100))
    for robot in air.links:
        assert of_others(air, robot) == []
        assert flows(air, robot) == {}
        told = [record for at, record in air.records(robot) if isinstance(record, Lsa) and at > 3]
        assert {record.node for record in told} == {BROADCAST}
        # One digest a beacon.
        assert len(told) <= 20
        assert not any(isinstance(record, Route) for _, record in air.records(robot))


@pytest.mark.slow
@pytest.mark.parametrize("dst", one_in(2, [4, BROADCAST]))
@pytest.mark.parametrize("more", [(), pytest.param(((2, 3),), marks=pytest.mark.long)])
def test_a_relay_that_dies_is_gone_around_and_nothing_is_lost(dst, more):
    air = mesh(*DIAMOND, *more)
    air.run(2.5)
    overrides = Overrides(dst=dst)
    air.flow(1, 100, every_s=PERIOD_S, overrides=overrides)
    (relay,) = flows(air, 1)[1, dst]
    died_at = air.now
    isolate(air, relay)
    air.flow(1, 200, every_s=PERIOD_S, first=100, overrides=overrides)
    air.run(air.now + 0.5)
    assert sorted(n for n in air.numbers(4) if n < 300) == list(range(300))
    back_at = min(
        air.sent_at[number] + age_s
        for robot, number, age_s, _ in air.got
        if robot == 4 and air.sent_at[number] > died_at
    )
    assert back_at - died_at < 0.4
    assert flows(air, 1)[1, dst] == [5 - relay]
    # It goes around once, and does not try the dead one again.
    (flow,) = (f for f in air.links[1].report(air.now).routes.flows if (f.src, f.dst) == (1, dst))
    assert flow.went_around == 1


@pytest.mark.slow
def test_a_relay_that_comes_back_is_used_if_it_is_needed():
    air = mesh((1, 2), (2, 3))
    air.run(2.5)
    air.flow(1, 20)
    isolate(air, 2)
    air.run(air.now + 12)
    assert flows(air, 1) == {}
    air.hears = both((1, 2), (2, 3))
    air.run(air.now + 2)
    air.flow(1, 20, first=100)
    air.run(air.now + 0.5)
    assert [n for n in air.numbers(3) if n >= 100] == list(range(100, 120))


@pytest.mark.slow
@pytest.mark.parametrize("dst", one_in(2, [3, BROADCAST]))
def test_the_only_relay_goes_on_though_its_answers_are_not_heard(dst):
    air = mesh((1, 2), (2, 3))
    air.run(2.5)
    overrides = Overrides(dst=dst)
    air.flow(1, 50, every_s=PERIOD_S, overrides=overrides)
    air.hears -= {(1, 2)}
    air.flow(1, 40, every_s=PERIOD_S, first=50, overrides=overrides)
    air.hears |= {(1, 2)}
    air.flow(1, 100, every_s=PERIOD_S, first=90, overrides=overrides)
    air.run(air.now + 0.5)
    assert sorted(air.numbers(3)) == list(range(190))


@pytest.mark.slow
def test_a_far_robot_that_restarts_is_believed_though_its_numbers_begin_anew():
    air = mesh((1, 2), (2, 3))
    air.run(2.5)
    for seed in (77, 78, 79):
        air.restart(3, seed)
        air.run(air.now + 4)
        assert {each.id for each in air.links[1].report(air.now).routes.robots} == {1, 2, 3}
        air.flow(1, 10, first=1000 * seed)
        air.run(air.now + 0.5)
        assert sum(n >= 1000 * seed for n in air.numbers(3)) == 10


@pytest.mark.slow
def test_what_is_only_for_neighbours_is_not_forwarded_and_receipts_are():
    air = mesh((1, 2), (2, 3))
    air.run(5.0)
    assert all(pdu[1] in (1, 3) for pdu in of_others(air, 2))
    n_control = sum(src == 1 for _, src, _ in air.bursts)
    assert len(of_others(air, 2)) < n_control / 2
    air.submit(1, 0, overrides=Overrides(dst=3, receipt="token"))
    air.run(air.now + 1.0)
    (verdict,) = air.links[1].take_verdicts()
    assert (verdict.receipt, verdict.fate) == ("token", "delivered")


@pytest.mark.slow
def test_a_destination_answers_within_a_tenth_of_a_second():
    air = mesh((1, 2))
    air.run(2.0)
    air.flow(1, 50, overrides=Overrides(dst=2))
    air.run(air.now + 0.2)
    answers = [
        (at, record)
        for at, record in air.records(2)
        if isinstance(record, Need) and not record.numbers()
    ]
    assert answers[-1][1].node == 1
    assert len(answers) >= 4
    # Nobody asks for an answer to what is for everyone, if nobody forwards it.
    before = len(answers)
    air.flow(1, 50, first=100)
    assert sum(isinstance(r, Need) and not r.numbers() for _, r in air.records(2)) == before


def test_a_robot_that_is_not_named_forwards_nothing():
    one, two = (make_link(i, relay=AUTO, hop_limit=4, pdu_size=64) for i in (1, 2))
    one.submit(0, bytes(8), 0.0)
    burst = compose(one, 0.0)
    two.hear(burst.pdus[0], 0.0)
    assert compose(two, 0.1) is None
    # Another robot names it in time.
    tell(two, 7, Route(1, BROADCAST, 0, b"\2"), at=0.2)
    assert parse(compose(two, 0.3).pdus[0], 64).src == 1
    assert rx(two).pdus_dropped == {"rx_control": 1}
    assert two.audit() == []


@pytest.mark.long
@law(40)
@given(st.integers(0, 2**32))
def test_in_any_mesh_everybody_gets_everything_once(seed):
    rng = Random(seed)
    robots = range(1, rng.randint(3, 7))
    pairs = [(each, rng.randrange(1, each)) for each in robots if each > 1]
    pairs += [pair for pair in combinations(robots, 2) if rng.random() < 0.25]
    air = mesh(*pairs, hop_limit=8)
    air.run(4.0)
    src = rng.choice(list(robots))
    air.flow(src, 30)
    air.run(air.now + 0.5)
    for robot in robots:
        if robot != src:
            assert sorted(air.numbers(robot)) == list(range(30)), (robot, pairs)
    n_forwards = sum(len(of_others(air, robot)) for robot in robots)
    assert n_forwards <= 2 * 30 * len(robots)


@law(200)
@given(st.integers(0, 2**32))
def test_a_tree_reaches_all_over_paths_that_are_nearly_the_best(seed):
    rng = Random(seed)
    robots = range(1, rng.randint(2, 12))
    edges = {robot: {} for robot in robots}
    for a, b in combinations(robots, 2):
        if rng.random() < 0.4:
            edges[a][b], edges[b][a] = rng.uniform(1, 3), rng.uniform(1, 3)
    source = rng.choice(list(robots))
    best = {source: 0.0}
    for _ in robots:
        # Bellman and Ford, as a second hand.
        for a in robots:
            for b, cost in edges[a].items():
                if a in best:
                    best[b] = min(best.get(b, 1e9), best[a] + cost)
    following = tree(edges, source)
    reached, todo = {source: 0.0}, [source]
    while todo:
        robot = todo.pop()
        for other, cost in edges[robot].items():
            if reached.get(other, 1e9) > reached[robot] + cost:
                reached[other] = reached[robot] + cost
        todo += following[robot]
        assert all(other in edges[robot] for other in following[robot])
    assert set(reached) == set(best)
    for robot in best:
        found = path(edges, source, robot)
        assert sum(edges[a][b] for a, b in pairwise(found)) == pytest.approx(best[robot])
        assert reached[robot] <= 1.1 ** len(best) * best[robot] + 1e-9


@pytest.mark.slow
def test_tables_are_bounded_whatever_is_told():
    link = make_link(1, relay=AUTO, hop_limit=4, pdu_size=128)
    rng = Random(5)
    for i in range(3000):
        src = rng.randrange(2, 255)
        records = [
            Lsa(rng.randrange(256), rng.randrange(1 << 16), ((1, 3), (src, 7), (src, 9))),
            Route(rng.randrange(256), rng.randrange(256), rng.randrange(1 << 32), bytes((1, 7))),
            Need(rng.randrange(256), rng.randrange(1 << 32), b"\0"),
        ]
        tell(link, src, *records[: rng.randrange(1, 4)], at=0.001 * i)
        if i % 50 == 0:
            link.handle_timers(0.001 * i)
    report = link.report(3.0).routes
    assert len(report.robots) <= 32
    assert link.audit() == []


@pytest.mark.slow
@pytest.mark.parametrize("pairs", [[(1, 2)], [(1, 3), (3, 2)]])
def test_the_first_pdu_of_a_flow_is_repeated_if_nobody_answers(pairs):
    """A single message is a flow of one PDU, and nothing after it shows that it is missing."""
    gone = []

    def lost(_to, src, _n, pdu):
        is_first = src == 1 and carries(77)(pdu) and len(gone) < 1
        gone.extend([pdu] * is_first)
        return is_first

    air = mesh(*pairs, lost=lost, clock=ClockParams(period_s=0.0), beacon_s=4.0)
    air.run(5.0)
    air.submit(1, 77, overrides=Overrides(dst=2))
    air.run(air.now + 0.6)
    assert gone
    assert air.numbers(2) == [77]
