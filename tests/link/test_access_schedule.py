"""`tdma`: which schedule is kept, and which is not, when robots come and go."""

from random import Random

import pytest

from sdrlinkd.link import Qos, Sensed
from sdrlinkd.link.access import FORGET_S, LISTEN_S, Wish, make_access
from sdrlinkd.wire import Frame
from tests.laws import one_in
from tests.link.air import Air
from tests.link.radios import LOCKSTEP, PACED, TX_WINDOWS, params
from tests.link.slots import LONGEST_S, SETTLED_S, make_air, places

radios = pytest.mark.parametrize("traits", [LOCKSTEP, PACED], ids=["lockstep", "paced"])


def make(own_id, **given):
    given = {"nodes": (1, 2, 3, 4), **given}
    return make_access(params("tdma", **given), own_id, LOCKSTEP, LONGEST_S, Random(1))


def begun(access, at):
    """The policy, which keeps a schedule by `at`."""
    access.slot(Wish(at, Qos.URGENT, 0.0005, Sensed(at)))
    return access


def kept(air, at):
    """(root, level) of each robot's schedule at the true time `at`, the end of the run."""
    frames = {i: node.access.frame(node.clock(at)) for i, node in air.nodes.items()}
    return {i: frame[:2] for i, frame in frames.items()}


@radios
def test_a_chain_keeps_one_schedule(traits):
    """Robot 3 hears only robot 2, and gets the schedule of robot 1 from it."""
    hears = {(1, 2), (2, 1), (2, 3), (3, 2)}
    for seed in range(2):
        air = make_air(3, traits, seed, hears=hears)
        air.offer_randomly(SETTLED_S + 3, per_s=8, begin_s=SETTLED_S)
        assert len(air.run(SETTLED_S + 3.5)) > 200
        air.assert_nobody_clashes()
        assert kept(air, SETTLED_S + 3.5) == {1: (1, 0), 2: (1, 1), 3: (1, 2)}
        assert "2 hops away" in air.nodes[3].access.state
        assert all(owner == burst.src for owner, _, burst in places(air, root=1)), f"seed {seed}"


@radios
def test_when_the_lowest_is_lost_the_schedule_goes_on(traits):
    for seed in range(6):
        air = make_air(3, traits, seed)
        air.run(SETTLED_S)
        air.leave(1)
        until = SETTLED_S + 2 * FORGET_S
        air.offer_randomly(until, per_s=4, begin_s=SETTLED_S)
        bursts = air.run(until)
        assert {burst.src for burst in bursts if burst.begin > until - 1} == {2, 3}
        air.assert_nobody_clashes()


def test_two_that_lost_their_root_do_not_lift_each_others_level_for_ever():
    air = make_air(3, LOCKSTEP, 1)
    air.run(SETTLED_S)
    air.leave(1)
    air.run(60.0)
    assert max(level for _, level in kept(air, 60.0).values()) < 10


@radios
def test_a_lower_root_that_appears_is_followed_by_all(traits):
    for seed in range(2):
        ids, came_at = [1, 2, 3], 7.0
        air = Air(
            [2, 3], params("tdma", ids, reuse=False), traits, seed, LONGEST_S,
            joins={2: 0.1 * seed, 3: 0.5}, ppm={2: 15, 3: -15}, beacons=True,
        )  # fmt: skip
        air.run(came_at)
        assert kept(air, came_at) == {2: (2, 0), 3: (2, 1)}
        air.join(1, at=came_at, ppm=10)
        air.offer_randomly(came_at + 7, per_s=10, begin_s=came_at)
        air.run(came_at + 7.5)
        assert kept(air, came_at + 7.5) == {1: (1, 0), 2: (1, 1), 3: (1, 1)}
        air.assert_nobody_clashes(since=came_at + 4)
        assert sum(burst.src == 1 for burst in air.bursts) > 100


@pytest.mark.slow
@pytest.mark.parametrize("n", one_in(2, [4, 2]), ids=["two groups of two", "two"])
@pytest.mark.parametrize(
    ("traits", "slot_s", "longest_s", "within_s"),
    one_in(3, [(PACED, 0.0, 0.004, 10), (LOCKSTEP, 0.0, 0.004, 10), (TX_WINDOWS, 0.4, 0.04, 20)]),
    ids=["lockstep", "paced", "tx windows"],
)
def test_who_come_back_into_reach_find_each_other_whatever_they_send(
    traits, slot_s, longest_s, within_s, n
):
    """All are overloaded, and their slots coincide wherever chance has put them."""
    for seed in range(3):
        ids, back_at = list(range(1, n + 1)), 5.0
        late = Random(seed).uniform(0, 2 * max(slot_s, 0.005))
        pairs = [(to, src) for to in ids for src in ids if to != src]
        hears = {(to, src) for to, src in pairs if (to - src) % 2 == 0}
        air = Air(
            ids, params("tdma", ids, reuse=False, slot_s=slot_s), traits, seed, longest_s,
            hears=hears, joins={i: late for i in ids if i % 2 == 0}, ppm={1: 15, 2: -15},
            beacons=True,
        )  # fmt: skip
        air.run(back_at)
        assert {root for root, _ in kept(air, back_at).values()} == {1, 2}
        hears.update(pairs)
        found_by = back_at + within_s
        for i in ids:
            for k in range(round(within_s / longest_s)):
                air.offer(i, back_at + k * longest_s)
        air.run(found_by)
        roots = {root for root, _ in kept(air, found_by).values()}
        assert roots == {1}, f"seed {seed}: slots {late:g} s apart"


def test_a_root_that_nobody_follows_leaves_some_of_its_slots_to_others():
    def used(nodes, is_followed=False):
        access = begun(make(1, nodes=nodes, reuse=False), 1.0)
        schedule, n = access.frame(1.0).schedule, 0
        for k in range(1000):
            at = 1.0 + k * access.round_s
            if is_followed:
                access.take_frame(2, Frame(1, 1, schedule, 0), at)
            n += access.slot(Wish(at, Qos.DEFAULT, 0.0005, Sensed(at))) is not None
            if at < 1.0 + FORGET_S:
                assert n == k + 1, "it gives them some time"
        return n

    passed = round(FORGET_S / make(1).round_s)
    assert 0.7 * (1000 - passed) + passed < used((1, 2, 3, 4)) < 0.8 * (1000 - passed) + passed
    assert used((1, 2, 3, 4), is_followed=True) == 1000
    assert used((1,)) == 1000, "who else could be there?"


@pytest.mark.slow
@radios
def test_a_root_that_starts_again_disturbs_nobody(traits):
    """The others still keep its schedule."""
    for seed in range(7):
        air = make_air(3, traits, seed)
        air.run(SETTLED_S)
        air.leave(1)
        air.offer_randomly(SETTLED_S + 2, per_s=15, begin_s=SETTLED_S)
        air.join(1, at=SETTLED_S + 0.5 + 0.0007 * seed)
        air.run(SETTLED_S + 3)
        air.assert_nobody_clashes()


@pytest.mark.parametrize(("own_id", "lower"), [(4, 0), (6, 1), (9, 2)])
def test_who_hears_no_schedule_begins_one_the_lowest_first(own_id, lower):
    """The lowest need not wait; the others start one after another."""
    access = make(own_id, nodes=(4, 9, 6))
    begins_at = LISTEN_S + lower
    if lower:
        begun(access, begins_at - 0.001)
        assert access.frame(begins_at - 0.001) is None
        assert access.state.endswith("listening for a schedule")
    assert begun(access, begins_at).frame(begins_at)[:2] == (own_id, 0)
    assert access.state.endswith(f"schedule of robot {own_id}")


def test_who_listens_sends_nothing():
    access = make(3)
    for at in (0.0, 1.0, 2.0):
        assert access.slot(Wish(at, Qos.URGENT, 0.0005, Sensed(at, at))) is None
    access.take_frame(2, begun(make(2), 9.0).frame(9.0), 2.1)
    slots = [
        access.slot(Wish(at, Qos.URGENT, 0.0005, Sensed(at)))
        for at in (2.1 + 0.0005 * step for step in range(200))
    ]
    assert any(slots)


@pytest.mark.parametrize(
    "other",
    [
        {"nodes": (2, 1, 3, 4)},
        {"nodes": (1, 2, 3)},
        {"slot_s": 0.05},
        {"guard_s": 0.001},
        {"minislot_s": 0.01},
        {"reuse": False},
    ],
    ids=str,
)
def test_another_schedule_is_told_of_and_not_followed(other):
    access = make(2)
    access.take_frame(1, begun(make(1, **other), 9.0).frame(9.0), 0.7)
    assert access.frame(1.0) is None
    (notice,) = access.notices(1.0)
    assert notice.startswith("robot 1 keeps a different tdma schedule; give both the same nodes, ")
    access.take_frame(1, begun(make(1), 9.0).frame(9.0), 0.7)
    assert access.notices(1.0) == []
    assert access.frame(1.0)[:2] == (1, 1)


def tell_twice(access, src, frame, at):
    """Robot `src` announces a schedule, and has done so a moment before."""
    before_s = 0.01
    phase_us = round(frame.phase_us - 1e6 * before_s) % round(1e6 * access.round_s)
    access.take_frame(src, frame._replace(phase_us=phase_us), at - before_s)
    access.take_frame(src, frame, at)


def test_the_fewest_hops_are_followed_and_the_parent_at_once():
    access = make(4)
    schedule = begun(make(1), 9.0).frame(9.0).schedule

    def told(at):
        root, level, _, phase_us = access.frame(at)
        return root, level, phase_us

    access.take_frame(3, Frame(2, 1, schedule, 1000), 10.0)
    assert told(10.0) == (2, 2, 1000)
    access.take_frame(2, Frame(2, 0, schedule, 2000), 10.05)
    assert told(10.0) == (2, 2, 1000), "a step in phase must be told twice"
    tell_twice(access, 2, Frame(2, 0, schedule, 2000), 10.1)
    assert told(10.1) == (2, 1, 2000)
    access.take_frame(3, Frame(2, 1, schedule, 7000), 10.2)
    assert told(10.1) == (2, 1, 2000), "further away"
    tell_twice(access, 2, Frame(2, 0, schedule, 2500), 10.3)
    assert told(10.3) == (2, 1, 2500), "the parent's clock is ours"
    tell_twice(access, 3, Frame(1, 7, schedule, 4000), 10.4)
    assert told(10.4) == (1, 8, 4000), "a lower root"
    access.take_frame(2, Frame(2, 0, schedule, 9000), 10.5)
    assert told(10.4) == (1, 8, 4000), "whom the old parent has not heard of yet"


def test_who_follows_another_goes_where_that_one_is_and_nowhere_else():
    """A newly started robot has its own schedule for a while."""
    access = begun(make(2), 9.0)
    schedule = access.frame(9.0).schedule
    for step in range(20):
        at = 10.0 + 0.5 * step
        tell_twice(access, 1, Frame(1, 0, schedule, 1000), at)
        access.take_frame(3, Frame(3, 0, schedule, 7000), at + 0.1)
        assert access.frame(at)[:2] == (1, 1)
        assert abs(access.frame(at).phase_us - 1000) <= 1


def test_who_has_no_followers_goes_where_others_are_and_is_followed_there():
    access = begun(make(2), 9.0)
    schedule = access.frame(9.0).schedule
    for at, phase_us in ((9.1, 777), (9.0 + FORGET_S, 7000)):
        own_us = access.frame(at).phase_us
        access.take_frame(3, Frame(3, 0, schedule, phase_us), at)
        taken_us = access.frame(at).phase_us
        assert access.frame(at)[:2] == (2, 0)
        assert abs(taken_us - (own_us if at < 10 else phase_us)) <= 1
    access.take_frame(3, Frame(2, 1, schedule, 7000), 12.5)
    own_us = access.frame(12.6).phase_us
    access.take_frame(4, Frame(4, 0, schedule, 99), 12.6)
    assert access.frame(12.6).phase_us == own_us


def test_who_follows_us_does_not_lead_us():
    access = begun(make(2), 9.0)
    schedule, before = access.frame(9.0).schedule, access.frame(20.0)
    for frame in (Frame(2, 1, schedule, 77), Frame(3, 0, schedule, 99)):
        access.take_frame(3, frame, 12.0)
        assert access.frame(20.0) == before


def test_a_level_never_leaves_its_octet():
    access = make(4)
    schedule = begun(make(1), 9.0).frame(9.0).schedule
    access.take_frame(3, Frame(1, 255, schedule, 0), 1.0)
    assert access.frame(1.0) is None
    access.take_frame(3, Frame(1, 254, schedule, 0), 1.0)
    assert access.frame(1.0)[:2] == (1, 255)


def test_the_phase_is_that_of_the_frame_at_any_time():
    access = begun(make(1), 9.0)
    frame_s = access.round_s
    for at in (9.0, 9.001, 12.3456, 1e5):
        told = access.frame(at)
        again = access.frame(at + 3 * frame_s)
        assert 0 <= told.phase_us <= round(1e6 * frame_s)
        off_us = (again.phase_us - told.phase_us) % (1e6 * frame_s)
        assert min(off_us, 1e6 * frame_s - off_us) <= 1.5


@pytest.mark.parametrize(("src", "root"), [(77, 0), (2, 0), (77, 1)])
def test_a_schedule_from_outside_the_nodes_is_ignored_and_told(src, root):
    access = begun(make(3), 1.0)
    before = access.state
    schedule = begun(make(1), 9.0).frame(9.0).schedule
    access.take_frame(src, Frame(root, 0, schedule, 5000), 1.1)
    assert access.state == before
    (told,) = access.notices(1.2)
    assert told.startswith(f"robot {src} announces a tdma schedule and is ignored")
