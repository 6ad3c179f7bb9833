"""The policy that auto selects, the capacity of each policy, and which ones are refused."""

from random import Random

import pytest

from sdrlinkd.errors import ConfigError
from sdrlinkd.link import (
    AccessParams,
    Outcome,
    Qos,
    RateParams,
    check_access,
    may_share,
    settle,
)
from sdrlinkd.wire import Frame
from tests.link.radios import LOCKSTEP, PACED, TX_WINDOWS, params
from tests.link.slots import schedule_of
from tests.link.world import make_link, next_burst

LONGEST_S = 0.005
ROOM = 200
SOON = LOCKSTEP._replace(react_s=1e-4)
QUICK = SOON._replace(pulse_s=4e-5, pdu_burst_s=(0.001,))
USRP = PACED._replace(
    kind="soapy", turnaround_s=0.0, lead_s=0.0205, longest_burst_s=(LONGEST_S,),
    pdu_burst_s=(0.003,),
)  # fmt: skip


def settled(wanted, traits=LOCKSTEP, own_id=1, longest_s=LONGEST_S, room=ROOM):
    return settle(wanted, own_id, traits, longest_s, Random(1), room)


def auto(nodes, **more):
    return AccessParams(nodes=nodes, **more)


def test_auto_is_the_default():
    assert AccessParams().policy == "auto"


@pytest.mark.parametrize("nodes", [[], [1]])
@pytest.mark.parametrize("traits", [LOCKSTEP, PACED, SOON, USRP, TX_WINDOWS])
def test_alone_it_is_none(nodes, traits):
    found = settled(auto(nodes), traits)
    assert (found.policy, found.reason) == ("none", "because access.nodes lists no other robot")
    assert found.access.state == "none"
    assert found.share > 0.9


@pytest.mark.parametrize("kind", ["direct", "gnuradio", "iqfile", "loopback"])
def test_without_an_air_that_robots_share_it_is_none(kind):
    deaf, alone = {"senses": False}, {"shares_air": False}
    for lacks in (deaf, alone, deaf | alone):
        found = settled(auto([1, 2]), LOCKSTEP._replace(kind=kind, **lacks))
        assert found.policy == "none"
    assert f'"{kind}"' in found.reason


@pytest.mark.parametrize("policy", ["auto", "minislot", "tdma", "csma"])
def test_who_only_receives_takes_no_turns(policy):
    found = settled(auto([1, 2], policy=policy), USRP._replace(transmits=False))
    assert (found.policy, found.reason) == ("none", "because this radio only receives")


def test_minislots_where_the_radio_reacts_within_a_millisecond_else_slots():
    soon, late = settled(auto([1, 2]), SOON), settled(auto([1, 2]), PACED)
    assert (soon.policy, late.policy) == ("minislot", "tdma")
    assert "takes 0.184 ms" in soon.reason
    assert (
        "takes 6.08 ms to notice another robot's burst; minislot allows at most 1 ms" in late.reason
    )
    edge = SOON._replace(react_s=0.0)
    rest_s = 0.001 - edge.lead_s - edge.detect_s - 5e-6
    assert settled(auto([1, 2]), edge._replace(react_s=rest_s - 1e-6)).policy == "minislot"
    assert settled(auto([1, 2]), edge._replace(react_s=rest_s + 1e-6)).policy == "grant"


def test_an_auction_from_three_robots_on_if_the_radio_sends_pulses_and_pdus_have_room():
    three = auto([1, 2, 3])
    assert settled(three, QUICK).policy == "auction"
    assert settled(auto([1, 2]), QUICK).policy == "minislot"
    assert settled(three, SOON).policy == "minislot"
    assert settled(three, QUICK, room=44).policy == "minislot"
    late = settled(three, QUICK._replace(react_s=0.002))
    assert late.policy == "tdma"
    assert "auction allows at most 1 ms" in late.reason
    assert all(settled(auto([*range(n)]), QUICK).policy == "auction" for n in range(3, 33))


def test_turns_by_request_where_all_have_one_sooner_than_a_slot():
    slow = USRP._replace(turnaround_s=0.05)
    for n in (2, 5, 8):
        found = settled(auto([*range(1, n + 1)]), slow)
        slots = settled(params("tdma", range(1, n + 1)), slow)
        assert found.policy == "grant"
        assert found.access.round_s < slots.access.round_s
        assert "all have had a turn after" in found.reason
    assert settled(auto([1, 2]), USRP).policy == "tdma"
    assert settled(auto([1, 2]), slow, room=44).policy == "tdma"
    windows = slow._replace(tx_window_s=1.0, rx_window_s=0.25)
    assert settled(auto([1, 2]), windows).policy == "tdma"


def test_slots_where_so_many_take_part_that_minislots_carry_less_than_half():
    policies = [settled(auto(list(range(n))), SOON, room=0).policy for n in range(2, 60)]
    assert policies == sorted(policies)
    assert set(policies) == {"minislot", "tdma"}
    many = settled(auto(list(range(60))), SOON, room=0)
    assert "with 60 robots minislot leaves" in many.reason


@pytest.mark.parametrize("traits", [SOON, PACED, USRP, TX_WINDOWS])
def test_all_robots_of_a_team_come_to_the_same(traits):
    nodes = [3, 1, 7]
    found = {own: settled(auto(nodes), traits, own) for own in nodes}
    assert len({(each.policy, each.reason, each.share) for each in found.values()}) == 1
    assert len({each.access.state.split(";")[0] for each in found.values()}) == 1


def test_nodes_are_checked_for_auto_too():
    for nodes, words in (([2, 3], "this robot's 1"), ([1, 2, 2], "each robot once")):
        with pytest.raises(ConfigError, match=words):
            check_access(auto(nodes), 1)
    check_access(auto([]), 1)


def test_it_listens_wherever_it_may_share():
    cases = {"none": False, "csma": True, "minislot": True, "tdma": True, "auto": True}
    assert {each: may_share(params(each, [1, 2]), 1) for each in cases} == cases
    assert not may_share(auto([1]), 1)


@pytest.mark.parametrize("policy", ["minislot", "csma"])
def test_what_carries_less_than_half_of_the_best_is_refused(policy):
    with pytest.raises(ConfigError) as error:
        settled(params(policy, [1, 2], force=False), USRP)
    said = str(error.value)
    assert said.startswith(f'access.policy: got "{policy}", which leaves ')
    for part in ("with 2 robots on this radio, where tdma leaves 97 %",
                 'allowed: "auto" or "tdma", or access.force = true'):  # fmt: skip
        assert part in said
    forced = settled(params(policy, [1, 2]), USRP)
    assert forced.share < 0.1 < 0.9 < forced.shares["tdma"]
    assert (forced.policy, forced.reason) == (policy, "as configured")
    assert forced.best == "tdma"


def test_the_best_and_half_of_it_are_taken():
    for wanted, traits in (("tdma", USRP), ("tdma", SOON), ("minislot", SOON), ("csma", SOON)):
        assert settled(params(wanted, [1, 2], force=False), traits).policy == wanted
    slow = {"pdu_burst_s": (0.002,), "longest_burst_s": (0.05,)}
    for traits in (USRP._replace(**slow), TX_WINDOWS._replace(**slow)):
        for n in (2, 5, 8):
            wanted = params("grant", [*range(1, n + 1)], force=False)
            assert settled(wanted, traits, longest_s=0.05).policy == "grant"
    assert settled(params("none", [1, 2], force=False), USRP).policy == "none"


def test_slots_that_are_mostly_guard_are_refused_too():
    with pytest.raises(ConfigError, match="where minislot leaves"):
        settled(params("tdma", [1, 2], force=False, slot_s=0.05, guard_s=0.04), SOON)


def test_a_link_refuses_it_at_attach_and_reports_what_it_came_to():
    link = make_link(1)
    with pytest.raises(ConfigError, match=r"access\.force"):
        link.attach(USRP, params("minislot", [1, 2], force=False), RateParams())
    settled = link.attach(USRP, auto([1, 2]), RateParams()).settled
    report = link.report(0.0)
    assert report.access.startswith("tdma: 2 slots")
    assert (report.access_policy, round(report.access_share_pct)) == ("tdma", 97)
    assert report.access_reason.startswith("because this radio takes")
    assert settled.sentence == (f"tdma, {report.access_reason}; 97 % of the airtime is usable")


def test_turns_by_request_need_room_for_a_plan():
    wanted = params("grant", [1, 2])
    with pytest.raises(ConfigError, match=r"link\.pdu_size: got 50; allowed .* at least 58"):
        make_link(pdu_size=50).attach(USRP, wanted, RateParams())
    with pytest.raises(ConfigError, match=r"got 57; allowed .* at least 58"):
        make_link(pdu_size=57).attach(USRP, wanted, RateParams())
    make_link(pdu_size=58).attach(USRP, wanted, RateParams())


def test_minislots_wait_for_those_of_the_higher_level_and_say_so():
    access = settled(params("minislot", [1, 2]), USRP).access
    assert access.turn_s == pytest.approx(3 * access.minislot_s)
    assert access.mean_wait_s(Qos.DEFAULT) >= access.turn_s


def test_tx_windows_cost_what_is_listened_between_them():
    traits = TX_WINDOWS._replace(tx_window_s=1.0, rx_window_s=0.25)
    assert settled(auto([1]), traits).share == pytest.approx(0.8, abs=0.01)


def notices_of(access, now=3.0):
    return " ".join(access.notices(now))


def test_robots_that_came_to_different_policies_are_told():
    slots = settled(params("tdma", [1, 2]), USRP).access
    minislots = settled(auto([1, 2]), SOON).access
    assert notices_of(slots) == notices_of(minislots) == ""
    minislots.take_frame(2, Frame(2, 0, 0x1234, 0), 1.0)
    assert "robot 2 keeps a schedule" in notices_of(minislots)
    for _ in range(3):
        assert notices_of(slots) == ""
        slots.beacon(2, 2.0)
    assert "robot 2 keeps no tdma schedule" in notices_of(slots)
    assert notices_of(slots, 70.0) == "", "it left, or was told"
    twin = settled(params("tdma", [1, 2]), USRP).access
    slots.take_frame(2, Frame(2, 0, schedule_of(twin), 0), 1.0)
    assert notices_of(slots) == ""
    slots.take_frame(2, Frame(2, 0, 0x1234, 0), 2.0)
    assert "a different tdma schedule" in notices_of(slots)
    assert notices_of(slots, 70.0) == ""
    assert notices_of(minislots, 70.0) == ""


def test_beacons_reach_the_policy():
    """Those of a robot that has no schedule; relayed ones say nothing."""
    teller, hearer = make_link(2, beacon_s=1.0), make_link(1)
    access = hearer.attach(USRP, params("tdma", [1, 2]), RateParams()).settled.access
    for number in range(3):
        assert notices_of(access) == ""
        now = 1.2 * number
        burst = next_burst(teller, now)
        teller.confirm(burst, Outcome.SENT, now)
        hearer.hear(burst.pdus[0], now)
    assert "robot 2 keeps no tdma schedule" in notices_of(access)


def test_who_takes_itself_for_alone_and_is_not_is_told():
    alone = settled(auto([]), USRP).access
    alone.heard(4, 1.0, True)
    assert notices_of(alone) == "", "a relay's may be far away"
    alone.heard(4, 1.0, False)
    assert "robot 4 shares this channel" in notices_of(alone)
    assert "list all robots in access.nodes" in notices_of(alone)
    assert notices_of(alone, 70.0) == "", "it left"
    wanted = settled(params("none", []), USRP).access
    wanted.heard(4, 1.0, False)
    assert notices_of(wanted) == ""
