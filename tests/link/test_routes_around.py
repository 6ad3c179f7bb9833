"""When a route goes around a robot, when it must not, and which way it then takes."""

from random import Random

import pytest

from sdrlinkd.link import Overrides
from sdrlinkd.link.routes import Routes
from sdrlinkd.wire import BROADCAST, DST, HOP, SEQ, SRC, Lsa
from tests.link.meshes import AUTO, flows, mesh

PERIOD_S = 0.02


def going_around(air):
    return {robot: link.report(air.now).routes.going_around for robot, link in air.links.items()}


@pytest.mark.long
def test_nobody_is_gone_around_for_pdus_that_hold_only_records():
    """Nobody answers for these, so a relay must not wait for answers to them."""
    air = mesh((1, 2), (2, 3), (2, 4), (3, 5), (4, 6))
    for _ in range(40):
        air.run(air.now + 0.25)
        assert not any(going_around(air).values())
    assert any(pdu[1] == 1 for _, src, burst in air.bursts if src == 3 for pdu in burst.pdus)


@pytest.mark.slow
def test_a_detour_does_not_lead_back_to_the_source():
    """Robot 4 does not know that robot 1 goes around 2, and its own best path leads there."""
    air = mesh((1, 2), (2, 3), (1, 4), (4, 5), (5, 6), (6, 7), (7, 3))
    air.run(2.5)
    overrides = Overrides(dst=3)
    air.flow(1, 20, every_s=PERIOD_S, overrides=overrides)
    broke_at = air.now
    air.hears -= {(2, 1)}
    air.flow(1, 60, every_s=PERIOD_S, first=20, overrides=overrides)
    air.run(air.now + 0.5)
    assert sorted(air.numbers(3)) == list(range(80))
    late_s = max(age_s for _, number, age_s, _ in air.got if air.sent_at[number] > broke_at)
    assert late_s < 0.5


@pytest.mark.slow
def test_no_detour_over_links_that_lose_nearly_all():
    """Robot 1 does not hear what 2 forwards and answers. All the same, 2 is the way."""
    rng = Random(1)
    is_deaf = False

    def lost(to, src, _n, _pdu):
        return (4 in (to, src) and rng.random() < 0.9) or (is_deaf and (to, src) == (1, 2))

    air = mesh((1, 2), (2, 3), (1, 4), (4, 3), lost=lost)
    air.run(4.0)
    overrides = Overrides(dst=3)
    air.flow(1, 20, every_s=PERIOD_S, overrides=overrides)
    is_deaf = True
    for number in range(20, 80):
        air.flow(1, 1, every_s=PERIOD_S, first=number, overrides=overrides)
        assert flows(air, 1)[1, 3] == [2]
    is_deaf = False
    air.run(air.now + 1.0)
    assert sorted(air.numbers(3)) == list(range(80))


def test_pdus_that_were_sent_out_of_order_are_given_up_together():
    """Otherwise a relay goes around the same robot anew every time that it looks."""
    routes = Routes(AUTO, 2, 6, 200, lambda: 0)
    routes.placed(3, BROADCAST, 1, 0.9, 20.0, is_direct=True, has_messages=False)
    routes.hear(3, Lsa(3, 1, ((2, 0),)), 0.9)
    routes.look(0.95)
    for number in (9, 13, 14, 15, 10):
        pdu = bytearray(64)
        pdu[SRC], pdu[DST], pdu[SEQ], pdu[HOP] = 1, 3, number, 5 << 4
        routes.sent(bytes(pdu), number, 1.0)
    for i in range(115):
        # Robot 3 is still heard.
        routes.placed(3, BROADCAST, i + 2, 1 + i / 20, 20.0, is_direct=True, has_messages=False)
        routes.look(1 + i / 20)
        if i == 20:
            assert routes.report(2.0).going_around == [3]
    assert routes.report(6.7).going_around == []


@pytest.mark.parametrize(
    ("snr_db", "least", "most"), [(9.0, 1.0, 1.1), (6.0, 1.5, 3.0), (5.0, 20.0, 100.0)]
)
def test_a_link_that_is_about_to_fail_costs_more_before_pdus_are_lost(snr_db, least, most):
    """A robot that drives out of range is not heard from one second to the next."""
    routes = Routes(AUTO, 2, 6, 200, lambda: 0)
    routes.set_needed_snr(6.6)
    routes.hear(3, Lsa(3, 1, ((2, 0),)), 0.0)
    for i in range(100):
        routes.placed(3, BROADCAST, i, i / 50, snr_db, is_direct=True, has_messages=False)
        routes.look(i / 50)
    assert least <= routes.take_links()[2][3] <= most


def test_a_good_link_behind_one_that_carries_nothing_is_no_problem():
    """Costs are sums, and 1 added to a very large number changes nothing."""
    routes = Routes(AUTO, 2, 6, 200, lambda: 0)
    routes.placed(3, BROADCAST, 1, 0.9, 20.0, is_direct=True, has_messages=False)
    for lsa in (Lsa(3, 1, ((2, 0), (4, 254))), Lsa(4, 1, ((3, 254), (5, 0))), Lsa(5, 1, ((4, 0),))):
        routes.hear(3, lsa, 0.9)
    routes.look(0.95)
    (flow,) = routes.report(1.0).flows
    assert flow.forwarded_by == [3]
