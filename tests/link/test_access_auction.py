"""`auction`: the most urgent message of all robots goes next, and nobody clashes."""

from collections import Counter
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import ConfigError
from sdrlinkd.link import Qos, Sensed
from sdrlinkd.link.access import Contest, Waiting, Wish, make_access, make_auction, n_bits
from sdrlinkd.wire import Want
from tests.laws import law
from tests.link.pulsing import FAST, PulsingAir
from tests.link.radios import LOCKSTEP, params

LONGEST_S = 0.004
SHORT_S = 0.0005
SETTLED_S = 1.5
"""Until then, robots do not know whether they have missed something."""
LARGER = [pytest.param(n, marks=pytest.mark.long) for n in (8, 24)]


def make_air(n, seed, **more):
    ppm = {node: Random(100 * seed + node).uniform(-20, 20) for node in range(n)}
    return PulsingAir(n, seed, ppm=ppm, **more)


def bound_s(n):
    """A burst that has just begun, its mini-slots, a contest, and a block at each end."""
    access = make_air(n, 0).nodes[0].access
    return LONGEST_S + access.pause_s + access.round_s + 2 * FAST.react_s


def waits_of(air, qos, since=SETTLED_S):
    return [each.begin - each.arrived_at for each in air.bursts if each.qos == qos
            and each.arrived_at > since]  # fmt: skip


def send_at_random(air, node, qos, until_s, per_s=20.0):
    at = SETTLED_S
    while (at := at + air.rng.expovariate(per_s)) < until_s:
        air.offer(node, at, qos, SHORT_S)


@pytest.mark.slow
@pytest.mark.parametrize("n", [3, *LARGER, 2])
def test_bursts_never_overlap_whoever_sends_whatever(n):
    for seed in range(3):
        air = make_air(n, seed)
        air.offer_randomly(2.0, per_s=40 / n)
        assert len(air.run(4.0)) > 200
        air.assert_nobody_clashes()
        assert air.disturbed() == []
        assert not any(node.waiting for node in air.nodes.values())


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 8, pytest.param(24, marks=pytest.mark.long)])
def test_a_quiet_hand_over_takes_two_mini_slots_and_all_have_the_same_share(n):
    air = make_air(n, 1)
    air.saturate(900 // n, qos=Qos.BULK)
    air.run(SETTLED_S + 2)
    late = [each for each in air.bursts if each.begin > SETTLED_S]
    access = air.nodes[0].access
    assert sum(each.end - each.begin for each in late) > 0.97 * 2 * access.carries(LONGEST_S)
    counts = Counter(each.src for each in late)
    assert len(counts) == n
    assert max(counts.values()) - min(counts.values()) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("n", [3, *LARGER])
@pytest.mark.parametrize(
    ("most", "one"),
    [
        (Qos.BULK, Qos.URGENT),
        (Qos.LATENCY, Qos.URGENT),
        (Qos.DEFAULT, Qos.LATENCY),
        (Qos.BULK, Qos.DEFAULT),
    ],
)
def test_what_is_more_urgent_waits_for_one_burst(n, most, one):
    air = make_air(n, 2)
    air.saturate(1500 // n, qos=most)
    send_at_random(air, n - 1, one, SETTLED_S + 3)
    air.run(SETTLED_S + 3.2)
    waits = waits_of(air, one)
    assert len(waits) > 30
    assert max(waits) <= bound_s(n) + 2 * SHORT_S
    assert air.bursts[-1].qos == most, "the others still had something"


@pytest.mark.long
def test_several_urgent_ones_at_once_wait_for_each_other_only():
    n = 8
    air = make_air(n, 3)
    air.saturate(300, qos=Qos.BULK)
    for k in range(20):
        for node in range(n):
            air.offer(node, SETTLED_S + 0.2 * k, Qos.URGENT, SHORT_S)
    air.run(SETTLED_S + 4.2)
    waits = waits_of(air, Qos.URGENT, SETTLED_S - 0.1)
    each_s = SHORT_S + air.nodes[0].access.round_s + FAST.react_s
    assert len(waits) == 20 * n
    assert max(waits) <= bound_s(n) + n * each_s
    air.assert_nobody_clashes()


@pytest.mark.slow
@pytest.mark.parametrize("n", [3, *LARGER])
@pytest.mark.parametrize("miss", [0.01, 0.1])
def test_whoever_misses_a_burst_does_not_clash(n, miss):
    for seed in range(2):
        air = make_air(n, seed, miss=miss)
        air.saturate(1500 // n, qos=Qos.BULK)
        send_at_random(air, 0, Qos.URGENT, SETTLED_S + 3)
        air.run(SETTLED_S + 3.2)
        air.assert_nobody_clashes()
        waits = sorted(waits_of(air, Qos.URGENT))
        assert waits[int(0.9 * len(waits))] <= 2 * bound_s(n)
        assert len({each.src for each in air.bursts if each.begin > SETTLED_S}) == n


@pytest.mark.long
@pytest.mark.parametrize("per_s", [5, 50, 500])
def test_foreign_energy_as_short_as_a_pulse_costs_air_and_silences_nobody(per_s):
    air = make_air(4, 5)
    air.saturate(400, qos=Qos.BULK)
    at, chance = 0.0, Random(1)
    while (at := at + chance.expovariate(per_s)) < 4:
        air.noise.append(at)
    air.run(4.0)
    late = [each for each in air.bursts if each.begin > SETTLED_S]
    assert sum(each.end - each.begin for each in late) > 0.4 * 2.5
    counts = Counter(each.src for each in late)
    assert min(counts.values()) > 0.6 * len(late) / 4
    clashes = [each for each in air.clashes() if each[0].begin > SETTLED_S]
    assert len(clashes) <= 0.02 * len(late)
    if per_s != 50:
        assert ("disturbs" in air.nodes[0].access.state) == (per_s == 500)


def test_one_that_counts_from_another_burst_disturbs_until_the_next_one():
    """A robot that comes back into range challenges at other times; the next burst corrects it."""
    access = make_access(params("auction", [1, 2]), 1, FAST, LONGEST_S, Random(1))
    minislot_s = access.pause_s / 2
    round_s = access.round_s

    def fruitless(end):
        """Two contests without a burst, after a burst that ended at `end`."""
        began = [end + minislot_s + 1e-6 + i * round_s for i in range(2)]
        pulses, now = [], end
        while now < began[1] + round_s + minislot_s:
            now += 1e-4
            pulses = [each for each in began if each + 2e-4 < now]
            idle_since = max([end, *pulses])
            sensed = Sensed(now, idle_since, None, end, end - 0.004, tuple(pulses))
            wish = Wish(now + FAST.lead_s, Qos.BULK, SHORT_S, sensed)
            slot = access.slot(wish)
            assert slot is None or slot.start >= end

    def burst(end):
        access.heard(2, end - 0.004, False)
        access.take_want(2, Want(2, 3, 0, 0, 200, 0), end - 0.004)
        sensed = Sensed(end + 1e-4, end, end - 0.004, end, end - 0.004)
        access.slot(Wish(end + 1e-4 + FAST.lead_s, Qos.BULK, SHORT_S, sensed))

    burst(1.0)
    assert not access.lacks
    fruitless(1.0)
    assert access.lacks
    assert "disturbs" in access.state
    burst(1.02)
    assert not access.lacks
    fruitless(1.02)
    assert access.lacks
    burst(1.04)
    assert access.lacks, "it goes on"
    burst(2.2)
    assert not access.lacks


def test_after_long_silence_all_may_begin_at_once():
    for seed in range(3):
        air = make_air(4, seed)
        for second in range(1, 30, 7):
            for node in air.nodes:
                air.offer(node, second + air.rng.uniform(0, 0.002))
        assert len(air.run(31.0)) == 20
        air.assert_nobody_clashes()


@pytest.mark.slow
def test_the_others_go_on_if_the_robot_that_is_next_has_left():
    for seed in range(3):
        air = make_air(5, seed)
        air.saturate(300, qos=Qos.BULK)
        air.run(SETTLED_S)
        air.leave(seed)
        air.run(SETTLED_S + 1)
        late = Counter(each.src for each in air.bursts if each.begin > SETTLED_S + 0.1)
        assert len(late) == 4
        assert max(late.values()) - min(late.values()) <= 2
        gaps = [b.begin - a.end for a, b in zip(air.bursts, air.bursts[1:], strict=False)
                if a.begin > SETTLED_S]  # fmt: skip
        access = next(iter(air.nodes.values())).access
        assert max(gaps) <= 2 * access.pause_s + access.round_s + FAST.react_s
        air.assert_nobody_clashes()


@law()
@given(st.data(), st.integers(2, 40))
def test_a_contest_has_one_winner_the_most_urgent_one(data, n):
    ranks = data.draw(st.sets(st.integers(0, n - 1), min_size=1))
    classes = {rank: data.draw(st.sampled_from(Qos)) for rank in ranks}
    waited = {rank: data.draw(st.booleans()) for rank in ranks}
    parts = {rank: Contest(classes[rank], rank, n, has_waited=waited[rank]) for rank in ranks}
    for bit in range(n_bits(n)):
        pulsing = {rank for rank, part in parts.items() if part.pulses(bit)}
        for rank, part in parts.items():
            if pulsing - {rank}:
                part.heard(bit)
    first = min(ranks, key=lambda rank: (classes[rank], not waited[rank], rank))
    assert [rank for rank, part in parts.items() if part.is_in] == [first]


def test_it_needs_pulses_and_a_place_in_the_list():
    with pytest.raises(ConfigError, match="sends no pulses"):
        make_access(params("auction", [1, 2]), 1, LOCKSTEP, LONGEST_S, Random(1))
    with pytest.raises(ConfigError, match=r"access\.nodes"):
        make_access(params("auction", [2, 3]), 1, FAST, LONGEST_S, Random(1))


def test_a_pulse_that_does_not_leave_ends_our_part_in_the_contest():
    """Robot 2 challenges, too, and would lose. Without our pulses it wins, so we are silent."""
    for has_left in (True, False):
        access = make_access(params("auction", [1, 2]), 1, FAST, LONGEST_S, Random(1))
        now, pulses, starts = 1.0, [], []
        while now < 1.0 + 2 * access.round_s and not (starts and not starts[-1].is_pulse):
            sensed = Sensed(now, 0.5, None, 0.5, None, tuple(pulses))
            slot = access.slot(Wish(now + FAST.lead_s, Qos.URGENT, SHORT_S, sensed))
            if slot is not None:
                starts.append(slot)
                if not pulses:
                    pulses.append(slot.start + 1e-5)
                now = slot.start + 1e-4
                if len(starts) == 1 and not has_left:
                    access.not_sent(slot.start)
            now += 1e-4
        end = starts[0].start + access.round_s - 1e-4
        kinds = [each.is_pulse for each in starts if each.start < end]
        assert kinds == ([True, True, True, True, False] if has_left else [True])


@pytest.mark.long
def test_a_mini_slot_that_was_missed_ends_our_part_too():
    """A host may stand still. The others then know nothing of our bit."""
    for seed in range(3):
        air = make_air(4, seed)
        air.saturate(200, qos=Qos.BULK)
        air.offer_randomly(3.0, per_s=20, classes=(Qos.URGENT, Qos.DEFAULT))
        chance, decide = Random(seed), air.decide

        def stalls(t, node, chance=chance, decide=decide):
            if chance.random() > 0.02:
                decide(t, node)

        air.decide = stalls
        assert len(air.run(3.0)) > 300
        air.assert_nobody_clashes(SETTLED_S)


@pytest.mark.long
def test_what_was_told_and_is_gone_is_not_sent_for_later():
    """Its robot was next, but had nothing. Later it has something again."""
    for seed in range(4):
        air = make_air(4, seed)
        air.saturate(400, qos=Qos.BULK)
        for k in range(30):
            at = SETTLED_S + 0.1 * k + air.rng.uniform(0, 0.02)
            air.offer(3, at, Qos.DEFAULT, SHORT_S)
            air.offer(3, at, Qos.DEFAULT, SHORT_S)
            air.schedule(at + 0.012, lambda t, node: node.waiting.clear(), air.nodes[3])
        air.run(SETTLED_S + 3.2)
        air.assert_nobody_clashes()


@pytest.mark.long
def test_something_urgent_of_a_robot_with_bulk_waits_for_nobodys_default():
    """Its bulk was told, and nobody was silent for longer, so it is next; but others challenge."""
    n, until_s = 8, SETTLED_S + 10
    air = make_air(n, 6)
    air.saturate(300, qos=Qos.BULK)
    for node in range(1, n):
        send_at_random(air, node, Qos.DEFAULT, until_s, per_s=10.0)
    send_at_random(air, 0, Qos.URGENT, until_s, per_s=4.0)
    air.run(until_s + 0.2)
    waits = waits_of(air, Qos.URGENT)
    assert len(waits) > 30
    # A contest for something of class default may just have begun.
    assert max(waits) <= bound_s(n) + air.nodes[0].access.round_s + LONGEST_S


@pytest.mark.slow
@pytest.mark.parametrize("most", [Qos.LATENCY, Qos.DEFAULT])
def test_nobody_waits_for_ever(most):
    air = make_air(4, 7)
    for _ in range(900):
        for node in (0, 3):
            air.offer(node, 0.0, most)
    for node in (1, 2):
        air.offer(node, SETTLED_S, Qos.BULK, SHORT_S)
    air.run(SETTLED_S + 4)
    assert len(waits_of(air, Qos.BULK, SETTLED_S - 0.1)) == 2
    air.assert_nobody_clashes()


@pytest.mark.slow
def test_who_is_next_with_something_more_urgent_needs_no_contest_with_itself():
    """A robot that fills the air with bulk has something urgent now and then; nobody else sends."""
    air = make_air(3, 5)
    for _ in range(600):
        air.offer(0, 0.0, Qos.BULK, LONGEST_S)
    for i in range(40):
        air.offer(0, SETTLED_S + 0.041 * i, Qos.URGENT, SHORT_S)
    air.run(4.0)
    # The rest of a burst, and a quiet hand-over: two mini-slots.
    most_s = LONGEST_S + air.nodes[0].access.pause_s + 2 * FAST.react_s
    waits = waits_of(air, Qos.URGENT, 0.0)
    assert len(waits) == 40
    assert max(waits) <= most_s


@pytest.mark.parametrize(("priority", "challenges"), [(10, False), (64, False), (100, True)])
def test_priority_counts_in_a_class(priority, challenges):
    access = make_access(params("auction", [1, 2]), 1, FAST, LONGEST_S, Random(1))
    access.heard(2, 0.99, False)
    access.take_want(2, Want(2, Qos.DEFAULT, 64, 0, 9, 0), 0.99)
    now, first = 1.0, None
    while first is None and now < 1.01:
        sensed = Sensed(now, 1.0, 0.99, 1.0, 0.99)
        waiting = Waiting(Qos.DEFAULT, priority, 0.0, 0.0)
        first = access.slot(Wish(now + FAST.lead_s, Qos.DEFAULT, SHORT_S, sensed, waiting))
        now += 1e-4
    assert first.is_pulse
    # Otherwise it waits for the second round, as robot 2 did not send.
    assert (first.start < 1.0 + access.pause_s) == challenges


def test_a_burst_that_does_not_leave_was_none():
    """The others have not heard what it told, so its robot is not next by that."""
    for has_left in (True, False):
        access = make_access(params("auction", [1, 2]), 1, FAST, LONGEST_S, Random(1))
        access.heard(2, 0.9, False)
        access.take_want(2, Want(2, Qos.BULK, 0, 0, 0, 0), 0.9)

        def look(now, end, at, access=access):
            sensed = Sensed(now, end, at, end, at)
            return access.slot(Wish(now + FAST.lead_s, Qos.BULK, SHORT_S, sensed))

        look(0.9505, 0.95, 0.9)
        access.told(Waiting(Qos.BULK, 0, 0.0, 1.0), 1.0)
        access.sent(1.01, None)
        if not has_left:
            access.not_sent(1.0)
            assert access.own_end < 1.0
        look(1.0105, 0.95, 0.9)
        access.heard(2, 1.02, False)
        access.take_want(2, Want(2, Qos.BULK, 0, 0, 0, 0), 1.02)
        now, slot = 1.03, None
        while slot is None:
            slot = look(now, 1.03, 1.02)
            now += 1e-4
        assert slot.is_pulse != has_left


times = st.floats(0, 3)
events = st.one_of(
    st.tuples(st.just("heard"), st.integers(0, 255), st.booleans()),
    st.tuples(st.just("want"), st.integers(0, 255), st.integers(0, 3), st.integers(0, 127)),
    st.tuples(st.just("not_sent"), times),
    st.tuples(st.just("sensed"), times, times, st.booleans(), st.lists(times, max_size=6)),
)


@law()
@given(st.lists(events, max_size=40))
def test_whatever_is_heard_slots_are_sound(given_events):
    access = make_auction(params("auction", [1, 2, 3]), 1, FAST)
    now, sensed = 1.0, Sensed(1.0, 0.0)
    for kind, *fields in given_events:
        now += 0.0007
        if kind == "heard":
            access.heard(fields[0], now, fields[1])
        elif kind == "want":
            access.take_want(fields[0], Want(fields[0], fields[1], fields[2], 0, 5, 5), now)
        elif kind == "not_sent":
            access.not_sent(fields[0])
        else:
            end, at, has_burst, pulses = fields
            burst_at = at if has_burst else None
            sensed = Sensed(now, end, burst_at, end, burst_at, tuple(sorted(pulses)))
        sensed = sensed._replace(until=now)
        waiting = Waiting(Qos.LATENCY, 64, 0.1, 0.002, 0.5)
        earliest = now + FAST.lead_s
        slot = access.slot(Wish(earliest, Qos.LATENCY, SHORT_S, sensed, waiting))
        if slot is not None:
            assert slot.start >= earliest - 1e-6
            if not slot.is_pulse:
                access.told(waiting, slot.start)
                access.sent(slot.start + SHORT_S, None)
    assert access.state


def test_who_takes_no_part_is_told_of():
    access = make_access(params("auction", [1, 2, 3]), 1, FAST, LONGEST_S, Random(1))
    for n in range(40):
        for pdu in range(3):
            access.heard(2, 0.1 * n, False)
            if not pdu:
                access.take_want(2, Want(2, 3, 0, 0, 5, 0), 0.1 * n)
        access.heard(3, 0.1 * n + 0.05, False)
    (notice,) = access.notices(4.0)
    assert notice.startswith("robot 3 takes no part in the auction")
    assert access.notices(100.0) == []


@pytest.mark.parametrize("policy", ["none", "csma", "minislot"])
def test_others_tell_of_who_takes_part(policy):
    """Robot 2 does, and this robot uses another policy. With tdma, it lacks a schedule."""
    access = make_access(params(policy, [1, 2]), 1, FAST, LONGEST_S, Random(1))
    assert not [each for each in access.notices(1.0) if "auction" in each]
    access.take_want(2, Want(2, 3, 0, 0, 5, 0), 1.0)
    assert [each for each in access.notices(2.0) if "robot 2 takes part in an auction" in each]
