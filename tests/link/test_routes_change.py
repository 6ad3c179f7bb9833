"""Links that change, and PDUs that are on their way meanwhile: they come, whoever has them."""

from collections import Counter
from itertools import pairwise, permutations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import Overrides
from sdrlinkd.link.routes import Routes, cost_of
from sdrlinkd.wire import BROADCAST, DST, HOP, MAX_LOSS, SEQ, SRC, Lsa, Route, share_of
from tests.laws import law
from tests.link.lossy import PDU_SIZE
from tests.link.meshes import AUTO, mesh, of_others
from tests.link.world import compose, make_link, records_in, tell

HOPS = 6
FAR = 9
"""A robot that nobody here hears."""


def relay(own_id):
    return make_link(own_id, relay=AUTO, hop_limit=HOPS, pdu_size=64)


def sent_to_far():
    """The PDU of robot 1 to the far robot."""
    one = relay(1)
    one.submit(0, bytes(8), 0.0, Overrides(dst=FAR))
    (pdu,) = compose(one, 0.0).pdus
    return pdu


def forwarded(link, at):
    """The hops left in the PDUs of robot 1 that a robot forwards."""
    burst = compose(link, at)
    return [pdu[HOP] >> 4 for pdu in burst.pdus if pdu[SRC] == 1] if burst else []


def by(robot, pdu, at):
    """The same PDU as another robot forwards it."""
    link = relay(robot)
    tell(link, 1, Route(1, FAR, 0, bytes((robot,))), at=at)
    link.hear(pdu, at)
    (copy,) = compose(link, at).pdus
    return copy


def named_late(teller, *, at=0.1, forwarded_by=(2,)):
    """Robot 3, which heard a PDU from its source, and those who forwarded it in turn, and is named
    for it after that.
    """
    three, pdu = relay(3), sent_to_far()
    three.hear(pdu, 0.0)
    tell(three, 1, Route(1, FAR, 0, b"\2"), at=0.01)
    for robot in forwarded_by:
        pdu = by(robot, pdu, 0.02)
        three.hear(pdu, 0.02)
    tell(three, teller, Route(1, FAR, 0, b"\3"), at=at)
    return three


def test_a_robot_that_has_a_pdu_from_its_source_forwards_it_for_the_relay_that_comes_next():
    """It also heard the relay forward it, and must not take that for its own part."""
    assert forwarded(named_late(teller=2), 0.2) == [HOPS - 2]
    assert forwarded(named_late(teller=2, forwarded_by=()), 0.2) == [HOPS - 1]


def test_what_another_robot_forwarded_for_the_source_is_not_forwarded_again():
    assert forwarded(named_late(teller=1), 0.2) == []
    assert forwarded(named_late(teller=1, forwarded_by=()), 0.2) == [HOPS - 1]


def test_what_went_on_from_the_relay_is_not_forwarded_again():
    assert forwarded(named_late(teller=2, forwarded_by=(2, 4)), 0.2) == []


def test_pdus_of_the_last_second_are_forwarded_after_all():
    assert forwarded(named_late(teller=2, at=0.8), 0.85) == [HOPS - 2]
    assert forwarded(named_late(teller=2, at=1.1), 1.15) == []


@pytest.mark.slow
def test_who_forwards_before_its_teller_answers_all_the_same():
    """Robot 3 hears robot 1, which does not hear it. Its copies have as many hops as those of 2."""
    air = mesh((1, 2), (2, 3), (3, 4))
    air.hears |= {(3, 1)}
    air.run(3.0)
    for number in range(40):
        air.flow(1, 1, every_s=0.05, first=number, overrides=Overrides(dst=4))
        assert air.links[2].report(air.now).routes.going_around == []
    air.run(air.now + 0.5)
    assert air.numbers(4) == list(range(40))
    copies = Counter(pdu[SEQ] for pdu in of_others(air, 2) if pdu[DST] == 4)
    assert max(copies.values()) == 1


@pytest.mark.slow
def test_a_robot_that_answers_for_others_may_still_not_know_that_it_is_named():
    """Robots 2 and 4 answer for PDUs to everyone, and with that for all PDUs of robot 1."""
    left = [1]

    def lost(to, src, _n, pdu):
        is_first = (to, src) == (2, 1) and any(
            isinstance(each, Route) and each.dst == 3 for each in records_in(pdu, PDU_SIZE)
        )
        return is_first and bool(left and left.pop())

    air = mesh((1, 2), (2, 3), (1, 4), (4, 5), lost=lost)
    air.run(3.0)
    air.flow(1, 10)
    for number in range(10, 50):
        dst = 3 if number % 2 else BROADCAST
        air.flow(1, 1, first=number, overrides=Overrides(dst=dst))
    air.run(air.now + 0.4)
    assert not left
    assert sorted(air.numbers(3)) == list(range(50))


robots = st.integers(2, 6)
losses = st.dictionaries(robots, st.sampled_from([0, 20, MAX_LOSS]), max_size=5)


@pytest.mark.slow
@law(200)
@given(st.lists(st.tuples(robots, losses, st.sampled_from([0.1, 6.0])), max_size=30))
def test_links_follow_from_the_newest_lsas_alone(told):
    """Robots that nobody reaches are forgotten meanwhile. What was given out does not change."""
    routes, now, newest, given_out = Routes(AUTO, 1, 6, 200, lambda: 0), 0.0, {}, []
    for number, (node, heard, pause_s) in enumerate(told):
        now += pause_s
        routes.look(now)
        kept = {each.id for each in routes.report(now).robots}
        newest = {each: of for each, of in newest.items() if each in kept}
        routes.hear(node, Lsa(node, number, tuple(heard.items())), now)
        newest[node] = heard
        wanted = {each: {} for each in newest}
        for one, other in permutations(newest, 2):
            way, back = newest[one].get(other, MAX_LOSS), newest[other].get(one, MAX_LOSS)
            if max(way, back) < MAX_LOSS:
                wanted[one][other] = cost_of(share_of(way + back))
        given_out.append((routes.take_links(), wanted))
    assert all(links == wanted for links, wanted in given_out)


def test_a_link_costs_the_same_whichever_way_loses_more():
    """Half of the PDUs and their answers arrive: by a rounding more would count as poor."""
    costs = []
    for loss in range(17):
        routes = Routes(AUTO, 1, 6, 200, lambda: 0)
        routes.hear(2, Lsa(2, 0, ((3, loss),)), 0.0)
        routes.hear(3, Lsa(3, 0, ((2, 16 - loss),)), 0.0)
        costs.append(routes.take_links()[2][3])
    assert costs == [4.0] * 17


def test_an_lsa_that_somebody_has_missed_is_told_again_as_long_as_it_is_new():
    """Whoever lacks it tells another digest, and takes us for deaf meanwhile."""
    routes, told_at = Routes(AUTO, 2, 6, 200, lambda: 0), []
    for i in range(100):
        now = i / 20
        routes.placed(3, BROADCAST, i, now, 20.0, is_direct=True, has_messages=False)
        routes.look(now)
        told_at += [now for told in routes.told(now) if getattr(told.record, "node", None) == 2]
        routes.hear(3, Lsa(BROADCAST, 7 ^ routes.digest().number, ()), now)
    new = [at for at in told_at if at < 3]
    assert all(later - at < 0.4 for at, later in pairwise(new))
    assert len(new) <= 13
    # All LSAs are told once a second, whatever is new.
    assert len(told_at) - len(new) == 2
