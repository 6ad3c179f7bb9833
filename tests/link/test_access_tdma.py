"""`tdma`: bursts stay in slots, none clash, and urgent messages are in time."""

from collections import Counter
from math import floor
from random import Random

import pytest

from sdrlinkd.link import Qos, Sensed
from sdrlinkd.link.access import CLOCK_ERROR_S, FORGET_S, Wish, make_access
from tests.link.radios import LOCKSTEP, PACED, params
from tests.link.slots import LONGEST_S, SETTLED_S, lengths_s, make_air, places

radios = pytest.mark.parametrize("traits", [LOCKSTEP, PACED], ids=["lockstep", "paced"])
sizes = pytest.mark.parametrize("n", [2, 4])


def make(own_id, traits=LOCKSTEP, longest_s=LONGEST_S, nodes=(1, 2, 3)):
    return make_access(params("tdma", nodes), own_id, traits, longest_s, Random(1))


def assert_in_slots(air):
    """Assert that each burst is within a slot and its guard, except for clock errors.

    Returns how many were in another robot's slot.
    """
    slot_s, guard_s = lengths_s(air)
    foreign = 0
    for owner, begin, burst in places(air, root=1):
        foreign += burst.src != owner
        end = begin + burst.end - burst.begin
        assert begin >= -CLOCK_ERROR_S, f"seed {air.seed}"
        assert end <= slot_s - guard_s + CLOCK_ERROR_S, f"seed {air.seed}"
    return foreign


@radios
@sizes
def test_bursts_stay_in_slots_of_their_own(traits, n):
    """From the first burst on, and while the clocks drift apart."""
    for seed in range(2):
        air = make_air(n, traits, seed)
        air.offer_randomly(SETTLED_S + 1.2, per_s=8, begin_s=SETTLED_S)
        assert len(air.run(SETTLED_S + 2)) > 20 * n
        air.assert_nobody_clashes()
        assert assert_in_slots(air) == 0


@radios
@sizes
@pytest.mark.parametrize("is_full", [False, True], ids=["some", "much"])
def test_slots_of_the_silent_are_used_by_others_and_nobody_clashes(traits, n, is_full):
    foreign = 0
    for seed in range(3):
        air = make_air(n, traits, seed, reuse=True)
        air.offer_randomly(SETTLED_S + 1, per_s=10, begin_s=SETTLED_S)
        if is_full:
            for _ in range(150):
                air.offer(air.rng.randint(1, n), SETTLED_S)
        air.run(SETTLED_S + 1.5)
        air.assert_nobody_clashes()
        foreign += assert_in_slots(air)
    # Here a slot is shorter than the mini-slots of a slow radio.
    assert foreign > 20 or not traits.is_lockstep


@sizes
def test_reuse_makes_the_air_of_one_robot_nearly_whole(n):
    """The control: reuse is useful."""
    sent = {}
    for reuse in (False, True):
        air = make_air(n, LOCKSTEP, 1, reuse=reuse)
        for _ in range(400):
            air.offer(1, SETTLED_S)
        sent[reuse] = sum(burst.src == 1 for burst in air.run(SETTLED_S + 0.6))
    assert sent[True] > 1.4 * sent[False]


@radios
@sizes
def test_all_get_the_same_when_all_have_too_much(traits, n):
    air = make_air(n, traits, 2, reuse=True, ppm=0.0)
    air.saturate(120, SETTLED_S)
    bursts = air.run(SETTLED_S + 0.8)
    shares = Counter(burst.src for burst in bursts if burst.begin > SETTLED_S)
    assert len(shares) == n
    assert max(shares.values()) < 1.2 * min(shares.values())
    air.assert_nobody_clashes()


@radios
@pytest.mark.parametrize("reuse", [False, True])
def test_an_urgent_message_waits_a_frame_at_most(traits, reuse):
    """However much else waits at any robot; no slot is ever empty here."""
    for seed in range(2):
        air = make_air(4, traits, seed, reuse=reuse, ppm=0.0)
        air.saturate(80, SETTLED_S)
        air.offer_randomly(SETTLED_S + 1, per_s=8, classes=(Qos.URGENT,), begin_s=SETTLED_S)
        bursts = [each for each in air.run(SETTLED_S + 1.5) if each.qos is Qos.URGENT]
        assert len(bursts) > 10
        longest_s = air.nodes[1].access.round_s + traits.lead_s + traits.react_s + traits.ahead_s
        for burst in bursts:
            assert burst.begin - burst.arrived_at < longest_s, f"seed {seed}"


@pytest.mark.parametrize("longest_s", [0.0003, 0.0005, 0.001, 0.004, 0.02])
@pytest.mark.parametrize("turnaround_s", [0.0, 50e-6, 500e-6])
def test_a_slot_is_made_so_long_that_its_guard_takes_a_tenth_at_most(longest_s, turnaround_s):
    access = make(1, LOCKSTEP._replace(turnaround_s=turnaround_s), longest_s, nodes=(1,))
    slot_s, guard_s = access.slot_s, access.guard_s
    times = (9.0 + 1e-4 * step for step in range(int(2e4 * slot_s)))
    slots = [access.slot(Wish(at, Qos.URGENT, longest_s, Sensed(at))) for at in times]
    rooms = [slot.end - slot.start for slot in slots if slot is not None]
    assert longest_s <= max(rooms) <= slot_s - guard_s + 1e-9
    assert guard_s == pytest.approx(turnaround_s + CLOCK_ERROR_S + 5e-6)
    assert guard_s <= 0.1 * slot_s * (1 + 1e-9)
    assert slot_s * 1e5 == pytest.approx(round(slot_s * 1e5)), "whole tens of micro-seconds"


def test_what_is_given_is_kept_to():
    given = params("tdma", (1, 2), slot_s=0.03, guard_s=0.002)
    access = make_access(given, 1, LOCKSTEP, LONGEST_S, Random(1))
    assert (access.slot_s, access.guard_s, access.round_s) == (0.03, 0.002, 0.06)
    assert access.state.startswith("tdma: 2 slots of 30 ms, guard 2 ms; ")


def assert_alike(one, other, begin):
    """Assert that both decide the same at any time from `begin` on."""
    granted = 0
    for step in range(300):
        until = begin + step * 1e-4
        wish = Wish(until + LOCKSTEP.lead_s, Qos.DEFAULT, 0.001, Sensed(until, begin - 0.01))
        slots = one.slot(wish), other.slot(wish)
        assert slots[0] == slots[1], step
        granted += slots[0] is not None
    assert granted


def two_of_robot_2():
    """(the same policy twice, start of its slot)"""
    pair = make(2), make(2)
    slot_s = pair[0].slot_s
    begin = 10.0 + 3 * slot_s
    for each in pair:
        root = make(1)
        root.slot(Wish(10.0, Qos.URGENT, 0.001, Sensed(10.0)))
        each.take_frame(1, root.frame(10.0)._replace(phase_us=0), 10.0 - slot_s)
    return *pair, begin


def test_a_burst_that_did_not_leave_was_never_there():
    one, twin, begin = two_of_robot_2()
    one.sent(begin + 0.002, None)
    one.not_sent(begin)
    assert_alike(one, twin, begin)


def test_a_burst_that_did_not_leave_takes_nothing_from_the_one_behind_it():
    """Two may be on their way to the radio when it reports that the first was late."""
    one, twin, begin = two_of_robot_2()
    one.sent(begin + 0.001, None)
    for each in (one, twin):
        each.sent(begin + 0.002, None)
    one.not_sent(begin)
    assert_alike(one, twin, begin)


def begun(access, since, for_s=0.2):
    """Owners of the slots in which one of three robots begins that hears nobody."""
    looks = (since + 5e-5 * i for i in range(int(for_s / 5e-5)))
    slots = (access.slot(Wish(at, Qos.BULK, 0.001, Sensed(at))) for at in looks)
    phases_us = [access.frame(slot.start).phase_us for slot in slots if slot]
    return {(1, 2, 3)[floor(1e-6 * each / access.slot_s + 1e-3) % 3] for each in phases_us}


def test_who_knows_of_a_robot_it_does_not_hear_uses_its_own_slots_only():
    """That robot may be sending, and the robot between them would hear neither."""
    access = make(3, LOCKSTEP, 0.004, nodes=(1, 2, 3))
    begun(access, 10.0)
    assert begun(access, 11.0) == {1, 2, 3}
    # Robot 2 hears robot 1, and so do we.
    access.heard(2, 12.0, False)
    access.heard(1, 12.0, False)
    access.told_of(1, 12.0, 2)
    access.told_of(3, 12.0, 2)
    assert begun(access, 12.1) == {1, 2, 3}
    # Now we no longer do.
    access.told_of(1, 15.0, 2)
    access.heard(2, 15.0, False)
    assert begun(access, 15.1) == {3}
    # Nobody does.
    assert begun(access, 15.0 + FORGET_S + 0.1) == {1, 2, 3}
