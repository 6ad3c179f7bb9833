"""Flows that reserve air: the rule, the planner's word over several hops, and bad words."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import (
    AdmissionParams,
    Overrides,
    PduLinkTraits,
    Qos,
    RelayParams,
    Told,
    TopicPolicy,
)
from sdrlinkd.link.packing import PiggybackRecords
from sdrlinkd.link.routes import cost_of
from sdrlinkd.link.schedule import Claim, TeamAir, admitted, planner_of, way_of
from sdrlinkd.wire import BROADCAST, Admit, Beacon, Flows, RecordType, ReservedFlow
from tests.laws import law, one_in
from tests.link.lossy import PDU_SIZE, Air
from tests.link.world import records_in, tell

AUTO = RelayParams(policy="auto")
PDU_S = 0.001
SIZE = 40
TRAITS = PduLinkTraits(pdu_burst_s=(PDU_S,), longest_burst_s=(0.02,))
BOTH_WAYS = {(1, 2), (2, 1), (2, 3), (3, 2)}
"""A chain: robots 1 and 3 do not hear each other."""

claims = st.lists(
    st.builds(
        Claim, st.tuples(st.integers(0, 5), st.integers(0, 20)), st.integers(0, 3),
        st.integers(0, 127), st.floats(1e-4, 1.0), st.booleans(),
    ),
    max_size=30, unique_by=lambda claim: claim.key,
)  # fmt: skip
limits = st.floats(0.0, 1.0)


def air_of(claims, keys):
    return sum(claim.air for claim in claims if claim.key in keys)


@law()
@given(claims, limits)
def test_what_is_admitted_fits(claims, limit):
    given_ = admitted(claims, limit)
    urgent = {claim.key for claim in claims if claim.qos == Qos.URGENT}
    assert urgent <= given_
    assert air_of(claims, given_) <= max(limit, air_of(claims, urgent)) + 1e-9


@law()
@given(claims, limits)
def test_nobody_is_refused_for_the_sake_of_a_lower_class(claims, limit):
    given_ = admitted(claims, limit)
    for claim in claims:
        if claim.key not in given_:
            higher = {
                each.key
                for each in claims
                if each.key in given_ and (each.qos, -each.priority) <= (claim.qos, -claim.priority)
            }
            assert air_of(claims, higher) + claim.air > limit - 1e-9


@law()
@given(claims)
def test_nobody_is_refused_where_all_fit(claims):
    assert admitted(claims, sum(claim.air for claim in claims) + 1e-9) == {c.key for c in claims}


@law()
@given(claims, limits, st.integers(0, 1000))
def test_the_order_of_hearing_does_not_matter(claims, limit, seed):
    mixed = Random(seed).sample(claims, len(claims))
    assert admitted(mixed, limit) == admitted(claims, limit)


@law()
@given(claims, limits, claims)
def test_whoever_has_air_keeps_it_beside_newcomers_that_are_no_higher(claims, limit, more):
    given_ = admitted(claims, limit)
    having = [claim._replace(had_air=claim.key in given_) for claim in claims]
    least = max(((c.qos, -c.priority) for c in having if c.had_air), default=(0, -127))
    known = {claim.key for claim in claims}
    newcomers = [
        each._replace(had_air=False)
        for each in more
        if each.key not in known and (each.qos, -each.priority) >= least and each.qos != Qos.URGENT
    ]
    assert given_ <= admitted([*having, *newcomers], limit)


def test_the_planner_is_the_lowest_that_all_hear():
    all_hear = {a: {b: 1.0 for b in (1, 2, 3) if b != a} for a in (1, 2, 3)}
    chain = {1: {2: 1.0}, 2: {1: 1.0, 3: 1.0}, 3: {2: 1.0}}
    assert [planner_of(all_hear, robot) for robot in (1, 2, 3)] == [1, 1, 1]
    assert [planner_of(chain, robot) for robot in (1, 2, 3)] == [2, 2, 2]
    assert planner_of({}, 7) == 7


def test_air_is_counted_over_the_whole_route():
    lossy = cost_of(1 / 1.5**2)
    chain = {1: {2: 1.0}, 2: {1: 1.0, 3: lossy}, 3: {2: lossy}}
    assert way_of(chain, 1, 3).n_sent == pytest.approx(2.5)
    assert way_of(chain, 1, 2).n_sent == 1.0
    assert way_of(chain, 1, BROADCAST) == (2.0, [2])
    assert way_of({}, 1, 9) == (1.0, [])


# A team.


def team(hears=BOTH_WAYS, robots=(1, 2, 3), relay=AUTO, lost=lambda *_: False, share=0.9, **more):
    hops = 6 if relay is AUTO else 1
    return Air(
        robots, hears=hears, relay=relay, hop_limit=hops, lost=lost, traits=TRAITS,
        admission=AdmissionParams(share=share), **more,
    )  # fmt: skip


def reserve(air, robot, share, qos="default", topic=0, **policy):
    """Let a topic of a robot reserve a share of the air for one transmission of each message."""
    policy = TopicPolicy(qos=qos, reserve=True, period_s=PDU_S / share, max_bytes=SIZE, **policy)
    air.links[robot].set_policy(topic, policy)


def words(air, robot):
    """What a robot knows of the flows of the team: (source, topic): admitted."""
    flows = air.links[robot].report(air.now).admission.flows
    return {(flow.src, flow.topic_id): flow.admitted for flow in flows}


def all_agree(air):
    """What every robot of the team knows of its flows."""
    known = [words(air, robot) for robot in air.links]
    assert all(each == known[0] for each in known)
    planners = {link.report(air.now).admission.planner for link in air.links.values()}
    assert len(planners) == 1
    return known[0]


@pytest.mark.slow
@pytest.mark.parametrize("loss", one_in(2, [0.3, 0.0]))
def test_over_two_hops_all_hear_the_same_word(loss):
    rng = Random(3)
    air = team(lost=lambda *_: rng.random() < loss)
    air.run(3.0)
    # To everyone over one relay: each takes twice its share.
    reserve(air, 1, 0.12, "latency")
    reserve(air, 3, 0.12, "default")
    reserve(air, 2, 0.12, "bulk", topic=1)
    air.run(air.now + (3.0 if loss == 0.0 else 12.0))
    assert all_agree(air) == {(1, 0): True, (3, 0): True, (2, 1): True}
    reserve(air, 1, 0.2, "default", topic=1)
    air.run(air.now + (3.0 if loss == 0.0 else 12.0))
    # 0.24 + 0.24 + 0.4 > 0.88, and more with losses: the one that came last waits, and what is
    # lower still fits.
    assert all_agree(air) == {(1, 0): True, (3, 0): True, (2, 1): True, (1, 1): False}
    report = air.links[3].report(air.now).admission
    assert report.planner == 2
    assert report.limit_pct == pytest.approx(88.0)
    assert report.admitted_pct <= report.limit_pct
    assert [flow.via for flow in report.flows if flow.src == 1] == [[2], [2]]


def test_noise_of_the_links_does_not_take_air_from_a_flow():
    air = TeamAir(AdmissionParams(), 2, 200, lambda: 100, relays=True)

    def word(cost):
        air.look(
            air_at.pop(0), [flow(air=13_000)._replace(dst=1)],
            {1: {2: 1.0}, 2: {1: cost_of(1 / cost**2)}}, 1.0,
        )  # fmt: skip
        (each,) = air.flows()
        return each.air

    air_at = [0.0, 1.0, 2.0, 3.0, 4.0]
    costs = [word(cost) for cost in (1.5, 1.6, 1.3, 2.0, 2.1)]
    assert costs == pytest.approx([13_000 / 32768 * cost for cost in (1.5, 1.5, 1.5, 2.0, 2.0)])


@pytest.mark.slow
def test_the_lowest_class_gives_way_and_comes_back():
    air = team(robots=(1, 2), hears={(1, 2), (2, 1)})
    reserve(air, 2, 0.5, "bulk")
    air.run(3.0)
    assert all_agree(air) == {(2, 0): True}
    reserve(air, 1, 0.6, "latency")
    air.run(air.now + 2.0)
    assert all_agree(air) == {(2, 0): False, (1, 0): True}
    air.links[1].set_policy(0, TopicPolicy())
    air.run(air.now + 2.0)
    assert all_agree(air) == {(2, 0): True}


@pytest.mark.long
def test_an_equal_newcomer_waits_and_a_planner_that_goes_leaves_the_word_behind():
    air = team(robots=(1, 2, 3), hears={(a, b) for a in (1, 2, 3) for b in (1, 2, 3) if a != b})
    air.run(2.0)
    reserve(air, 3, 0.5)
    air.run(4.0)
    reserve(air, 2, 0.5)
    air.run(6.0)
    assert all_agree(air) == {(3, 0): True, (2, 0): False}
    air.hears = {(2, 3), (3, 2)}
    air.run(air.now + 30.0)
    for robot in (2, 3):
        assert words(air, robot) == {(3, 0): True, (2, 0): False}
        assert air.links[robot].report(air.now).admission.planner == 2


def test_a_team_without_relays_agrees_too():
    air = team(robots=(1, 2), hears={(1, 2), (2, 1)}, relay=RelayParams())
    reserve(air, 1, 0.5)
    reserve(air, 2, 0.5)
    air.run(3.0)
    assert all_agree(air) == {(1, 0): True, (2, 0): False}


@pytest.mark.slow
def test_a_robot_that_restarts_is_believed_at_once():
    air = team(robots=(1, 2), hears={(1, 2), (2, 1)})
    reserve(air, 2, 0.5)
    air.run(3.0)
    air.restart(2, seed=77)
    air.restart(1, seed=78)
    reserve(air, 2, 0.3)
    air.run(air.now + 4.0)
    assert all_agree(air) == {(2, 0): True}
    (flow,) = air.links[1].report(air.now).admission.flows
    assert flow.rate_hz == pytest.approx(300, rel=1e-3)


def test_numbers_begin_anew_with_a_robot_that_restarts():
    air = TeamAir(AdmissionParams(), 2, 200, lambda: 100, relays=False)
    links = {1: {2: 1.0}, 2: {1: 1.0}}

    def heard(*records):
        for record in records:
            air.take(1, record, 1.0)
        air.look(1.0, [flow()], links, 1.0)
        return {(each.src, each.flow.topic): each.is_admitted for each in air.flows()}

    air.look(0.0, [flow()], links, 1.0)
    assert heard(Flows(1, 500, (flow(3),)), Admit(1, 900, 2, b"\0")) == {(1, 3): None, (2, 0): True}
    older = Flows(1, 499, (flow(4),)), Admit(1, 899, 2, b"", b"\0")
    assert heard(*older) == {(1, 3): None, (2, 0): True}
    air.newcomer(1, 1.0)
    assert heard(*older) == {(1, 4): None, (2, 0): False}
    assert heard(Flows(1, 500, ()), Admit(1, 900, 2, b"\0")) == {(2, 0): True}


def test_an_earlier_life_of_ours_is_overtaken():
    air = TeamAir(AdmissionParams(), 1, 200, lambda: 100, relays=False)
    links = {1: {2: 1.0}, 2: {1: 1.0}}
    air.look(0.0, [flow()], links, 1.0)
    air.take(2, Flows(1, 4000, ()), 0.1)
    air.take(2, Admit(1, 5000, 1, b"", b"\0"), 0.1)
    air.look(0.2, [flow(), flow(1)], links, 1.0)
    numbers = {type(each.record): each.record.number for each in air.told(0.2)}
    assert numbers == {Flows: 4001, Admit: 5001}


def test_refused_messages_have_a_name_and_urgent_ones_pass():
    air = team(robots=(1, 2), hears={(1, 2), (2, 1)})
    reserve(air, 1, 0.6, "latency", topic=1)
    reserve(air, 2, 0.5, "bulk")
    air.run(4.0)
    link = air.links[2]
    assert link.submit(0, b"\0\1\0\0abc", air.now, Overrides(receipt="r")) == "tx_not_admitted"
    (verdict,) = link.take_verdicts()
    assert (verdict.receipt, verdict.reason) == ("r", "tx_not_admitted")
    assert link.submit(0, b"\0\1\0\0abc", air.now, Overrides(qos=Qos.URGENT)) is None
    assert link.submit(2, b"\0\1\0\0abc", air.now) is None
    report = link.report(air.now)
    assert report.tx.dropped == {"tx_not_admitted": 1}
    assert link.audit() == []
    (notice,) = link.notices(air.now)
    assert notice.startswith("odom: class bulk, not admitted: it needs 50 % of the air, and 60 of")
    lines = link.why(0, Told("the file", ()), air.now)
    assert any("the team's air is full" in line and "tx_not_admitted, 1" in line for line in lines)
    assert lines[-1] == (
        "refused by robot 1: it needs 50 % of the air over its route; 60 of 88 % are taken, by "
        "scan of robot 1 (latency, 60 %)"
    )
    assert air.links[1].notices(air.now) == []
    said = air.links[1].why(1, Told("the file", ()), air.now)
    assert said[-1] == "admitted by robot 1: has 60 % of the air over its route"


def test_an_urgent_flow_is_never_refused():
    air = team(robots=(1, 2), hears={(1, 2), (2, 1)})
    reserve(air, 1, 0.6, "urgent")
    reserve(air, 2, 0.9, "urgent")
    air.run(3.0)
    assert all_agree(air) == {(1, 0): True, (2, 0): True}
    tell(air.links[2], 1, Admit(1, 30_000, 2, b"", b"\0"), at=air.now)
    assert air.links[2].submit(0, b"\0\1\0\0abc", air.now) is None


def test_with_share_0_nothing_is_told():
    air = team(robots=(1, 2), hears={(1, 2), (2, 1)}, share=0.0)
    reserve(air, 1, 0.9)
    reserve(air, 2, 0.9)
    air.run(4.0)
    assert words(air, 1) == words(air, 2) == {}
    assert not any(isinstance(record, Flows | Admit) for _, record in air.records(1))


@pytest.mark.slow
def test_without_reserved_topics_not_an_octet_is_told():
    air = team()
    air.run(6.0)
    told = [record for robot in air.links for _, record in air.records(robot)]
    assert told
    assert not any(isinstance(record, Flows | Admit) for record in told)


@pytest.mark.parametrize("kind", [RecordType.FLOWS, RecordType.ADMIT])
def test_a_beacon_does_not_replace_them(kind):
    waiting = PiggybackRecords()
    waiting.put_as((kind, 1), Flows(1, 1) if kind == RecordType.FLOWS else Admit(1, 1, 1), 0.0)
    waiting.offer([Beacon(1, 1)])
    assert waiting.holds(kind)


@pytest.mark.long
def test_records_alone_take_little_air():
    robots = range(1, 9)
    air = team(robots=robots, hears={(a, b) for a in robots for b in robots if a != b})
    air.run(3.0)
    for robot in robots:
        reserve(air, robot, 0.1)
    air.run(5.0)
    began_s = air.now
    air.run(air.now + 5.0)
    told = [
        pdu
        for at, _, burst in air.bursts
        for pdu in burst.pdus
        if at > began_s
        and any(isinstance(record, Flows | Admit) for record in records_in(pdu, PDU_SIZE))
    ]
    # Even if each had been sent for their sake alone.
    assert told
    assert len(told) * PDU_S / 5.0 < 0.02


# What cannot be true.


def flow(topic=0, air=300, period_us=1000, size=40, qos=2):
    return ReservedFlow(topic, BROADCAST, qos, 64, air, period_us, size)


@pytest.mark.slow
@pytest.mark.parametrize(
    "record",
    [
        Flows(255, 1, (flow(),)),
        Flows(2, 1, (flow(air=0),)),
        Flows(2, 1, (flow(air=32769),)),
        Flows(2, 1, (flow(period_us=0),)),
        Flows(2, 1, (flow(size=0),)),
        Flows(2, 1, (flow(), flow())),
        Flows(2, 1, tuple(flow(topic) for topic in range(17))),
        Admit(9, 1, 1, b"\0", b""),
        Admit(2, 1, 1, b"\0", b""),
    ],
)
def test_what_cannot_be_true_is_ignored_and_counted(record):
    air = team(robots=(1, 2), hears={(1, 2), (2, 1)}, pdu_size=512)
    air.run(3.0)
    link = air.links[1]
    tell(link, 2, record, at=air.now)
    air.run(air.now + 0.2)
    report = link.report(air.now).admission
    assert report.flows == []
    assert report.records_ignored == 1


@pytest.mark.slow
def test_flows_of_32_robots_are_held_at_most():
    air = team(robots=(1, 2), hears={(1, 2), (2, 1)})
    air.run(3.0)
    for node in range(10, 100):
        tell(air.links[1], 2, Flows(node, 1, (flow(),)), at=air.now)
    air.run(air.now + 0.2)
    assert len(words(air, 1)) == 32
    # Nobody says them again.
    air.run(air.now + 32.0)
    assert words(air, 1) == {}


@pytest.mark.slow
def test_no_more_than_16_flows_of_a_robot_reserve_air():
    topics = [(f"topic_{i}", "std_msgs/String") for i in range(15)]
    air = Air((1, 2), hears={(1, 2), (2, 1)}, topics=topics, traits=TRAITS)
    for topic in range(15):
        reserve(air, 1, 0.01, topic=topic)
    air.run(3.0)
    # A PDU of 128 octets has room for seven of them: the first by class, priority and number.
    assert words(air, 2) == {(1, topic): True for topic in range(7)}
