"""`minislot`: nodes that hear each other never collide, and urgent messages go first."""

from collections import Counter
from itertools import pairwise
from random import Random

import pytest

from sdrlinkd.link import Qos, Sensed
from sdrlinkd.link.access import LEVELS, MiniSlots, Wish
from tests.link.air import Air
from tests.link.radios import DETECT_S, LOCKSTEP, PACED, params

MS = 0.002
NODES = [7, 2, 5]
EVER = 100.0

radios = pytest.mark.parametrize("traits", [LOCKSTEP, PACED], ids=["lockstep", "paced"])
sizes = pytest.mark.parametrize("n", [2, 3, 4, 5])


def make_air(n, traits, seed, **more):
    ids = Random(seed).sample(range(255), n)
    return Air(ids, params("minislot", ids), traits, seed, **more)


def make(node_id, nodes=NODES):
    return MiniSlots(node_id, nodes, MS, DETECT_S)


def first_start(access, idle_since, burst_at, qos=Qos.DEFAULT):
    """The start of a node that wants to send from `idle_since` on, while no other node does."""
    until = idle_since
    while until < idle_since + 1:
        wish = Wish(until + MS / 4, qos, 0.001, Sensed(until, idle_since, burst_at))
        slot = access.slot(wish)
        if slot is not None:
            assert slot.late_end == slot.start
            return slot.start
        until += MS / 8
    raise AssertionError("it waits for ever")


@pytest.mark.slow
@radios
@sizes
def test_bursts_never_overlap_whoever_sends_whatever(traits, n):
    for seed in range(3):
        air = make_air(n, traits, seed)
        air.offer_randomly(0.7, per_s=(5, 10, 30)[seed % 3], fixed=seed % 2 == 0)
        bursts = air.run(2.0)
        assert len(bursts) > 7 * n, f"seed {seed}: the control"
        air.assert_nobody_clashes()


def test_the_same_traffic_without_access_overlaps():
    """The control: otherwise the law above would prove nothing."""
    for n in (2, 5):
        air = Air(range(n), params("none", range(n)), LOCKSTEP, 1)
        air.offer_randomly(1.0, per_s=10)
        air.run(2.0)
        assert len(air.clashes()) > 5


@radios
@sizes
def test_the_very_first_bursts_do_not_overlap(traits, n):
    for seed in range(4):
        air = make_air(n, traits, seed)
        for qos in Qos:
            air.saturate(1, qos=qos)
        bursts = air.run(1.5)
        assert len(bursts) == 4 * n, f"seed {seed}"
        air.assert_nobody_clashes()


@radios
def test_after_long_silence_all_may_begin_at_once(traits):
    for seed in range(4):
        air = make_air(4, traits, seed)
        for second in range(1, 30, 7):
            for node_id in air.nodes:
                qos = air.rng.choice(list(Qos))
                air.offer(node_id, second + air.rng.uniform(0, 0.01), qos)
        assert len(air.run(40)) == 20
        air.assert_nobody_clashes()


@pytest.mark.slow
def test_clocks_may_drift_apart_while_nobody_sends():
    """Beacons come once per second; meanwhile two clocks of ±20 ppm drift apart by 40 µs."""
    for seed in range(12):
        rng = Random(seed)
        air = make_air(3, LOCKSTEP, seed)
        ppm = dict.fromkeys(air.nodes, -20.0) | {rng.choice(list(air.nodes)): 20.0}
        air = make_air(3, LOCKSTEP, seed, ppm=ppm)
        for second in range(1, 60):
            for node_id in air.nodes:
                air.offer(node_id, second + rng.uniform(0, 0.008), rng.choice(list(Qos)))
        assert len(air.run(62)) == 3 * 59
        air.assert_nobody_clashes()


@pytest.mark.slow
@radios
def test_a_burst_that_some_could_not_read_leads_to_no_collision(traits):
    for seed in range(8):
        air = make_air(3, traits, seed, miss=0.15)
        air.offer_randomly(2.0, per_s=4)
        assert len(air.run(3.0)) > 40
        air.assert_nobody_clashes()


@pytest.mark.slow
@radios
def test_urgent_goes_before_default_of_any_other_at_a_carriers_end(traits):
    """Among the messages that waited when a burst ended, the next has the higher level."""
    seen = 0
    for seed in range(3):
        air = make_air(3, traits, seed)
        air.offer_randomly(1.5, per_s=12, classes=(Qos.URGENT, Qos.DEFAULT))
        bursts = air.run(3.0)
        for i, (before, chosen) in enumerate(pairwise(bursts), start=1):
            # A node that has just sent is deaf for a moment, so it knows the air as late as others.
            waited = [each for each in bursts[i:] if each.arrived_at < before.end]
            if any(each.qos is Qos.URGENT for each in waited):
                assert chosen.qos is Qos.URGENT, f"seed {seed}: {before} {chosen}"
                seen += any(each.qos is Qos.DEFAULT for each in waited)
    assert seen > 8


@radios
@sizes
def test_nobody_starves_when_all_have_too_much(traits, n):
    air = make_air(n, traits, 3)
    air.saturate(200)
    shares = Counter(burst.src for burst in air.run(1.0))
    assert len(shares) == n
    assert max(shares.values()) < 2 * min(shares.values())
    air.assert_nobody_clashes()


def test_each_waits_a_bounded_time_also_for_an_air_that_is_full():
    air = make_air(4, LOCKSTEP, 5)
    air.saturate(400)
    bursts = air.run(2.0)
    longest_s = max(burst.end - burst.begin for burst in bursts)
    round_s = next(iter(air.nodes.values())).access.round_s
    for node_id in air.nodes:
        own = [burst.begin for burst in bursts if burst.src == node_id]
        gaps = [later - earlier for earlier, later in pairwise(own)]
        assert max(gaps) < 4 * (longest_s + round_s)


@pytest.mark.parametrize("last", NODES)
@pytest.mark.parametrize("qos", list(Qos))
def test_each_node_has_a_place_of_its_own_and_the_last_sender_the_last(last, qos):
    starts = {}
    for node_id in NODES:
        access = make(node_id)
        if node_id == last:
            access.sent(5.0, None)
        else:
            access.heard(last, 4.9, False)
        starts[node_id] = first_start(access, 5.0, 4.9, qos)
    first = 5.0 + MS * (1 + len(NODES) * (qos > Qos.LATENCY))
    in_order = NODES[NODES.index(last) + 1 :] + NODES[: NODES.index(last) + 1]
    assert [starts[each] for each in in_order] == pytest.approx(
        [first + i * MS for i in range(len(NODES))]
    )


@pytest.mark.parametrize("qos", list(Qos))
def test_who_could_not_read_the_last_burst_stays_out_of_the_round(qos):
    """Others know who sent it; their mini-slots differ from those that this node would compute."""
    access = make(2)
    access.heard(7, 3.0, False)
    round_s = LEVELS * len(NODES) * MS
    for unread in (None, 4.9):
        assert first_start(access, 5.0, unread, qos) >= 5.0 + round_s + MS - 1e-9
    access.heard(7, 4.9, False)
    assert first_start(access, 5.0, 4.9, qos) < 5.0 + round_s


def test_a_robot_that_is_not_of_ours_makes_nobody_first():
    access = make(2)
    access.heard(99, 4.9, False)
    assert first_start(access, 5.0, 4.9) >= 5.0 + LEVELS * len(NODES) * MS


def test_nobody_begins_while_the_channel_is_busy_or_before_those_ahead_have_passed():
    access = make(7)
    access.heard(5, 4.9, False)
    start = 5.0 + MS
    assert first_start(access, 5.0, 4.9, Qos.URGENT) == pytest.approx(start)
    for until, idle_since in ((4.95, 5.0), (5.5, 5.6), (start - MS, 5.0)):
        wish = Wish(until + 0.0005, Qos.URGENT, 0.001, Sensed(until, idle_since, 4.9))
        assert access.slot(wish) is None
    own = make(7)
    own.sent(6.0, None)
    assert own.slot(Wish(5.5, Qos.URGENT, 0.001, Sensed(5.5, 5.0, 4.9))) is None


@pytest.mark.parametrize("sent_before", [False, True])
def test_a_burst_that_did_not_leave_was_never_there(sent_before):
    access, twin = make(2), make(2)
    for each in (access, twin):
        if sent_before:
            each.sent(4.0, None)
        each.heard(7, 4.9, False)
    access.sent(5.3, None)
    access.not_sent(5.2)
    for qos in Qos:
        assert first_start(access, 5.0, 4.9, qos) == first_start(twin, 5.0, 4.9, qos)
        assert first_start(access, 3.5, 3.4, qos) == first_start(twin, 3.5, 3.4, qos)


def test_it_says_its_times():
    assert make(2).state == "minislot: 3 robots, 2 ms each, round in 18 ms"
    assert make(2).round_s == pytest.approx(0.018)
    assert make(2).notices(1.0) == []
    assert make(2).frame(0.0) is None
