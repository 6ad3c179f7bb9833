"""`auction` falls back to `grant` while not all robots hear each other, and goes on afterwards."""

from itertools import pairwise
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backends import AirParams, Outage, Track
from benchmarks.team.teams import Flow, Strain, Team
from sdrlinkd.config import ModemParams
from sdrlinkd.link import Qos, Sensed
from sdrlinkd.link.access import BACK_S, Waiting, Wish, make_access
from sdrlinkd.wire import LAST_PLAN, Frame, Grant
from tests.laws import law
from tests.link.pulsing import FAST
from tests.link.radios import params
from tests.link.turns import tell, told_events

LONGEST_S = 0.004
PDU_S = 0.0005
RADIO = FAST._replace(pdu_burst_s=(PDU_S,), longest_burst_s=(LONGEST_S,))
AIR = AirParams(rate_hz=5e6, block_s=2e-4, snr_db_at_1m=70.0, path_loss_exponent=3.0)
MODEM = ModemParams(rate_hz=AIR.rate_hz, mcs=3, max_burst_s=0.02, block_s=AIR.block_s)
NEAR, FAR = (10.0, 0.0), (90.0, 0.0)
"""Where robot 1 hears robot 5, and with it all others or none of them."""
OTHERS = {1: (0.0, 0.0), 2: (-90.0, 0.0), 3: (-85.0, 10.0), 4: (-88.0, -5.0)}


def drive(waypoints, seconds, seed=1, lost=0.0, relays=True, off=None):
    """Let robot 5 move about, and the others send bulk; returns (team, policies over time)."""
    tracks = {node: Track([(0.0, *place)]) for node, place in OTHERS.items()}
    tracks[5] = Track([(at, *place) for at, place in waypoints])
    n = round(10 * (seconds - 3.0))
    pairs = ((1, 2), (2, 1), (5, 1), (1, 5), (5, 2), (2, 5))
    flows = [
        Flow(f"u{src}{dst}", src, dst, 64, 0.1, n, 2.0 + 0.013 * src, qos="urgent")
        for src, dst in pairs
    ] + [Flow(f"b{src}", src, 1, 4000, 0.05, 2 * n, 2.0, qos="bulk") for src in (2, 3, 4)]
    strain = Strain(tracks=tracks, keep_s=0.05, lost=lost, relays=relays, off=off or {})
    team = Team(range(1, 6), None, flows, seed, "auction", modem=MODEM, air=AIR, strain=strain)
    used = []
    for i in range(1, 1 + round(10 * seconds)):
        team.simulation.run(0.1 * i)
        used.append({node: access_of(team, node).state.split(":")[0] for node in team.ids})
    return team, used


def access_of(team, node):
    return team.simulation.stations[node].settled.access


def lost_in(team, *names):
    """When the lost messages of some flows were sent."""
    return [
        heard.sent_at[number]
        for heard in team.heard
        if heard.flow.name in names
        for number in range(heard.flow.n)
        if number not in heard.at
    ]


def changes(used):
    """How often robots have changed between the two policies."""
    return sum(one[node] != two[node] for one, two in pairwise(used) for node in one)


@pytest.mark.long
def test_a_robot_that_goes_and_comes_back_is_reached_over_a_relay_meanwhile():
    track = [(0.0, NEAR), (5.0, NEAR), (8.0, FAR), (17.0, FAR), (20.0, NEAR)]
    team, used = drive(track, 27.0)
    # Each robot falls back once and returns once.
    assert changes(used) == 10
    assert set(used[40].values()) == {"auction"}
    assert set(used[150].values()) == {"grant"}
    assert set(used[-1].values()) == {"auction"}
    assert lost_in(team, "u12", "u21", "u15") == []
    # Robots notice that they do not hear each other, and then have turns, and routes.
    assert all(6.0 < at < 12.0 for at in lost_in(team, "u25", "u52", "u51"))


@pytest.mark.long
@pytest.mark.parametrize("relays", [True, False])
def test_turns_by_request_from_the_start_where_some_do_not_hear_each_other(relays):
    team, used = drive([(0.0, FAR)], 13.0, seed=2, relays=relays)
    assert all(set(each.values()) == {"grant"} for each in used[75:])
    assert [at for at in lost_in(team, "u12", "u21", "u15", "u51") if at > 7.5] == []
    if relays:
        # Routes are found once nobody sends at the same time any more.
        assert [at for at in lost_in(team, "u25", "u52") if at > 9.5] == []
    notices = access_of(team, 1).notices(13.0)
    assert any("turns by request instead of the auction" in each for each in notices)


@pytest.mark.long
@pytest.mark.parametrize("relays", [False, True])
def test_where_all_hear_all_losses_and_robots_that_leave_end_no_auction(relays):
    off = {3: [Outage(3.0, 5.5), Outage(7.0, 11.2)], 4: [Outage(4.0, 60.0)]}
    _, used = drive([(0.0, NEAR)], 15.0, seed=3, lost=0.05, relays=relays, off=off)
    assert changes(used) == 0


TOGETHER = {1: {2: 1.0, 3: 1.0}, 2: {1: 1.0, 3: 1.0}, 3: {1: 1.0, 2: 1.0}}
APART = {1: {2: 1.0, 3: 1.0}, 2: {1: 1.0}, 3: {1: 1.0}}
"""Robots 2 and 3 do not hear each other."""


def access_with(edges=TOGETHER, seconds=10):
    """(Robot 1 of 1, 2 and 3, which has heard beacons of the others for some time; the time)."""
    access = make_access(params("auction", [1, 2, 3]), 1, RADIO, LONGEST_S, Random(1))
    access.know_links(edges)
    for i in range(seconds):
        beacons(access, 1.0 + i)
    return access, float(seconds)


def beacons(access, at):
    for src in (2, 3):
        access.heard(src, at, False)
        access.beacon(src, at)


def ask(access, now):
    waiting = Waiting(Qos.DEFAULT, 64, 0.1, 0.002, 0.5)
    return access.slot(Wish(now, Qos.DEFAULT, PDU_S, Sensed(now, now - 0.1), waiting))


def schedule():
    """What identifies the schedule: that of a robot that has begun to plan."""
    access, now = access_with(APART)
    for _ in range(9000):
        now += 1e-3
        slot = ask(access, now)
        if access.by_request is not None and slot is not None:
            return access.by_request.told(slot.start, PDU_S, 100)[0].schedule
    raise AssertionError


SCHEDULE = schedule()


def test_a_team_of_two_needs_no_turns():
    access = make_access(params("auction", [1, 2]), 1, RADIO, LONGEST_S, Random(1))
    access.take_frame(2, Frame(2, 0, SCHEDULE, 0), 1.0)
    access.take_grant(2, Grant(1, 1, 1000, ((1, 10),)), 1.0)
    assert access.state.startswith("auction")
    assert access.by_request is None


def test_a_plan_is_followed_and_the_last_one_brings_the_auction_back():
    access, now = access_with()
    assert access.state.startswith("auction")
    access.take_frame(2, Frame(2, 0, SCHEDULE, 0), now)
    access.take_grant(2, Grant(1, 1, 1000, ((1, 40),)), now)
    assert access.state.startswith("grant")
    assert "instead of the auction, as not all robots heard each other lately" in access.state
    assert access.by_auction is None
    access.take_frame(2, Frame(2, 0, SCHEDULE, 0), now + 0.1)
    access.take_grant(2, Grant(2, 1, 1000, LAST_PLAN), now + 0.1)
    assert access.state.startswith("auction")
    assert access.by_request is None


def test_a_last_plan_that_was_not_heard_is_missed_only_for_some_rounds():
    access, now = access_with()
    access.take_frame(2, Frame(2, 0, SCHEDULE, 0), now)
    access.take_grant(2, Grant(1, 1, 1000, ((1, 40),)), now)
    until = now + BACK_S + 3 * access.round_s
    while now < until:
        now += 0.5
        beacons(access, now)
        ask(access, now)
    assert access.state.startswith("auction")


def test_a_poor_link_counts_as_none_after_some_time():
    """Robots 2 and 3 lose half of their PDUs on the way to each other."""
    poor = {**TOGETHER, 2: {1: 1.0, 3: 16.0}, 3: {1: 1.0, 2: 16.0}}
    access, now = access_with()
    ask(access, now)
    access.know_links(poor)
    for after_s in range(1, 10):
        beacons(access, now + after_s)
        is_apart = after_s > 7
        assert ("robots 2 and 3 do not hear each other" in access.state) == is_apart
        assert bool(access.lacks) == is_apart
    access.know_links(TOGETHER)
    beacons(access, now + 10.0)
    assert "do not hear" not in access.state


def test_a_robot_that_has_gone_is_not_one_that_others_do_not_hear():
    access, now = access_with()
    access.know_links({**TOGETHER, 3: {2: 1.0}, 1: {2: 1.0}})
    for i in range(1, 6):
        access.heard(2, now + i, False)
        access.beacon(2, now + i)
        assert "do not hear" not in access.state


def busy(access, since, until, sources=(2, 3)):
    """Let robots be heard all the time; returns when others were first said not to hear each other,
    or None.
    """
    for i in range(round(50 * (until - since))):
        now = since + i / 50
        for src in sources:
            access.heard(src, now, False)
            access.beacon(src, now)
        if "do not hear" in access.state:
            return now
    return None


@pytest.mark.parametrize("sources", [(2,), ()])
def test_a_pause_of_a_robot_or_of_ours_is_not_deafness(sources):
    """LSAs told that 2 and 3 do not hear each other, and robot 3, or all, were silent for 1 s."""
    access, _ = access_with()
    assert busy(access, 10.0, 15.0) is None
    access.know_links(APART)
    assert busy(access, 15.0, 15.1) is None
    assert busy(access, 15.1, 16.0, sources) is None
    assert 18.5 <= busy(access, 16.0, 20.0) < 18.6


def test_a_pause_that_is_not_noticed_and_a_lost_lsa_together_are_not_deafness():
    """Where robots are heard every half second, a pause of 1 s shows nothing."""
    access = make_access(params("auction", [1, 2, 3]), 1, RADIO, LONGEST_S, Random(1))
    access.know_links(APART)
    for i in range(9):
        at = 1.0 + i / 2
        for src in (2,) if i == 1 else (2, 3):
            access.heard(src, at, False)
            access.beacon(src, at)
        # In the 2 s after the pause, an LSA that was lost can come again.
        assert ("do not hear" in access.state) == (at > 4.5)


def test_a_report_of_what_was_heard_long_ago_is_not_believed():
    """The LSA of robot 2 denies that it hears robot 3, which has gone."""
    access, _ = access_with()
    assert busy(access, 10.0, 15.0) is None
    access.know_links(APART)
    for i in range(8):
        assert busy(access, 15.0 + i / 2, 15.5 + i / 2, (2,)) is None
        access.told_of(3, 15.5 + i / 2, 2)


def test_of_others_only_two_that_we_hear_can_be_apart():
    """Robot 3 has gone, and 2 has noticed; robot 4 tells of it for longer."""
    all_but = {node: {other: 1.0 for other in range(1, 5) if other != node} for node in range(1, 5)}
    access = make_access(params("auction", range(1, 5)), 1, RADIO, LONGEST_S, Random(1))
    access.know_links(all_but)
    assert busy(access, 10.0, 15.0, (2, 3, 4)) is None
    for node in (1, 2):
        all_but[node].pop(3)
    access.know_links(all_but)
    for i in range(40):
        access.told_of(3, 15.0 + i / 10, 4)
        assert busy(access, 15.0 + i / 10, 15.1 + i / 10, (2, 4)) is None


octet, times = st.integers(0, 255), st.floats(-1, 3)
whatever = st.one_of(
    told_events,
    st.tuples(
        st.just("plan"),
        st.integers(1, 3),
        octet,
        st.lists(st.tuples(st.integers(1, 3), octet), max_size=4) | st.just([*LAST_PLAN]),
    ),
    st.tuples(st.just("links for long"), st.sampled_from([TOGETHER, APART])),
    st.tuples(st.just("late"), octet),
    st.tuples(st.just("sensed"), octet, times, st.lists(times, max_size=4)),
)


@law()
@given(st.lists(whatever, max_size=60), st.integers(1, 3))
def test_whatever_is_heard_slots_are_sound(events, own_id):
    access = make_access(params("auction", [1, 2, 3]), own_id, RADIO, LONGEST_S, Random(1))
    now, sensed, last = 1.0, Sensed(1.0, 0.0), 0.0
    for event in events:
        kind, *fields = event
        now += 0.03
        if kind == "late":
            access.not_sent(last)
        elif kind == "plan":
            src, number, turns = fields
            access.take_frame(src, Frame(src, 0, SCHEDULE, 0), now)
            access.take_grant(src, Grant(number, 1, 1000, tuple(turns)), now)
        elif kind == "links for long":
            access.know_links(fields[0])
            for _ in range(8):
                now += 0.5
                beacons(access, now)
        elif kind == "sensed":
            end, pulses = fields[1:]
            sensed = Sensed(now, end, None, end, None, tuple(sorted(pulses)))
        else:
            tell(access, event, SCHEDULE, now, 0.03)
        sensed = sensed._replace(until=now)
        slot = access.slot(
            Wish(now, Qos.LATENCY, PDU_S, sensed, Waiting(Qos.LATENCY, 64, 0.1, 0.002, 0.5))
        )
        assert access.state
        assert isinstance(access.notices(now), list)
        assert (access.by_request is None) != (access.by_auction is None)
        if slot is None:
            continue
        assert slot.start >= now - 1e-6
        last = slot.start
        if not slot.is_pulse:
            if access.by_request is not None and access.by_request.must_tell:
                access.by_request.told(slot.start, PDU_S, 100)
            access.sent(slot.start + PDU_S, None)
