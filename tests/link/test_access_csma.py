"""`csma`: it waits for an idle air, yields to urgent messages, and collides rarely; `none`."""

from itertools import pairwise
from random import Random
from statistics import mean

import pytest

from sdrlinkd.link import Qos, Sensed
from sdrlinkd.link.access import CSMA_WINDOWS as WINDOWS
from sdrlinkd.link.access import Csma, Free, Slot, Wish
from tests.link.air import Air
from tests.link.radios import DETECT_S, LOCKSTEP, PACED, params

SLOT = 0.002
DWAIT = 0.003
LONGEST_S = 0.02
radios = pytest.mark.parametrize("traits", [LOCKSTEP, PACED], ids=["lockstep", "paced"])


def make(seed=1, persist=0.2):
    return Csma(DWAIT, SLOT, persist, DETECT_S, Random(seed))


def first_start(access, idle_since, qos=Qos.DEFAULT, earliest=0.0):
    """Its start time if the air stays idle from `idle_since` on."""
    until = idle_since
    while until < idle_since + 10:
        wish = Wish(max(earliest, until + SLOT / 4), qos, 0.001, Sensed(until, idle_since))
        slot = access.slot(wish)
        if slot is not None:
            assert slot.late_end == slot.start
            assert slot.start >= wish.earliest
            return slot.start
        until += SLOT / 8
    raise AssertionError("it waits for ever")


@pytest.mark.slow
@radios
@pytest.mark.parametrize("n", [2, 4])
def test_nobody_begins_on_a_busy_channel_that_could_be_sensed(traits, n):
    """A burst that began too shortly before the decision cannot be detected: chance."""
    late = 0
    for seed in range(2):
        air = Air(range(n), params("csma", []), traits, seed, LONGEST_S)
        air.offer_randomly(2.0, per_s=4)
        bursts = air.run(6.0)
        assert len(bursts) > 15 * n
        for i, burst in enumerate(bursts):
            for other in bursts[max(0, i - 10) : i]:
                if other.end > burst.begin and other.src != burst.src:
                    late += 1
                    assert other.begin > burst.until - 2 * DETECT_S, f"seed {seed}"
    assert late < 100


@pytest.mark.slow
@radios
@pytest.mark.parametrize("n", [2, 4])
def test_it_collides_less_than_without_access_though_sometimes(traits, n):
    """The control for every law without collisions: this air does have them."""
    clashes = {"none": 0, "csma": 0}
    for policy in clashes:
        for seed in range(2):
            air = Air(range(n), params(policy, []), traits, seed, LONGEST_S)
            air.offer_randomly(2.0, per_s=4)
            assert len(air.run(8.0)) > 15 * n
            clashes[policy] += len(air.clashes())
    assert 0 < clashes["csma"] < clashes["none"] / 3


@pytest.mark.slow
def test_the_more_urgent_wait_less_on_average():
    waited_s = {qos: [] for qos in Qos}
    for seed in range(3):
        air = Air(range(4), params("csma", [], persist=0.05), LOCKSTEP, seed)
        # Each robot has one class, so that only the air decides, not a queue.
        for node_id, qos in enumerate(Qos):
            at = 0.0
            while (at := at + air.rng.expovariate(20)) < 3:
                air.offer(node_id, at, qos)
        for burst in air.run(10.0):
            waited_s[burst.qos].append(burst.begin - burst.arrived_at)
    means = [mean(waited_s[qos]) for qos in Qos]
    assert all(1.3 * earlier < later for earlier, later in pairwise(means)), means


@pytest.mark.parametrize("qos", list(Qos))
@pytest.mark.parametrize("seed", range(5))
def test_it_begins_in_a_slot_after_dwait_and_the_wait_of_its_class(qos, seed):
    start = first_start(make(seed), 5.0, qos)
    slots = (start - 5.0 - DWAIT) / SLOT
    assert slots == pytest.approx(round(slots), abs=1e-6)
    assert round(slots) >= WINDOWS[qos][0]


@pytest.mark.parametrize("qos", list(Qos))
def test_with_a_chance_of_one_it_takes_the_first_slot(qos):
    waits, eagerness = WINDOWS[qos]
    persist = 1 / min(1.0, eagerness)
    assert first_start(make(persist=persist), 5.0, qos) == pytest.approx(5.0 + DWAIT + waits * SLOT)


@pytest.mark.parametrize(("qos", "persist"), [(Qos.DEFAULT, 0.2), (Qos.LATENCY, 0.05)])
def test_each_slot_has_the_same_chance(qos, persist):
    """The number of skipped slots is geometric: mean (1 - p) / p."""
    waits, eagerness = WINDOWS[qos]
    chance = eagerness * persist
    access = make(7, persist)
    begin = DWAIT + waits * SLOT
    passed = [
        round((first_start(access, 10.0 * i, qos) - 10.0 * i - begin) / SLOT) for i in range(1, 800)
    ]
    assert min(passed) == 0
    assert mean(passed) == pytest.approx((1 - chance) / chance, rel=0.15)
    assert passed.count(0) / len(passed) == pytest.approx(chance, rel=0.2)


def test_it_waits_until_the_channel_is_idle():
    access = make()
    for until, idle_since in ((5.0, 5.1), (5.05, 5.1), (5.09, 5.091)):
        wish = Wish(until + 0.001, Qos.URGENT, 0.001, Sensed(until, idle_since))
        assert access.slot(wish) is None
    assert first_start(access, 5.1, Qos.URGENT) >= 5.1 + DWAIT
    own = make()
    own.sent(6.0, None)
    assert own.slot(Wish(5.8, Qos.URGENT, 0.001, Sensed(5.7, 5.0))) is None
    assert first_start(own, 5.9, Qos.URGENT) >= 6.0 + DWAIT


def test_a_slot_is_kept_to_while_nothing_changes():
    """A new draw at each query would change the probabilities of all slots."""
    for seed in range(20):
        start = first_start(make(seed, persist=0.1), 5.0)
        # A twin is asked at first, and then no more until that slot.
        twin = make(seed, persist=0.1)
        starts = {
            slot.start
            for until in (5.0, start - SLOT / 2)
            if (slot := twin.slot(Wish(until + SLOT / 4, Qos.DEFAULT, 0.001, Sensed(until, 5.0))))
        }
        assert starts == {start}, f"seed {seed}"


def test_a_busy_channel_or_another_class_draws_anew():
    slow = first_start(make(3, persist=0.01), 5.0, Qos.BULK)
    other_class, busy = make(3, persist=0.01), make(3, persist=0.01)
    for access in (other_class, busy):
        assert access.slot(Wish(5.001, Qos.BULK, 0.001, Sensed(5.0, 5.0))) is None
    assert first_start(other_class, 5.0, Qos.URGENT) < slow
    slots = (first_start(busy, 5.2007, Qos.BULK) - 5.2007 - DWAIT) / SLOT
    assert slots == pytest.approx(round(slots), abs=1e-6)
    assert round(slots) >= WINDOWS[Qos.BULK][0]


@pytest.mark.parametrize("sent_before", [False, True])
def test_a_burst_that_did_not_leave_was_never_there(sent_before):
    access, twin = make(5), make(5)
    if sent_before:
        for each in (access, twin):
            each.sent(4.0, None)
    access.sent(5.3, None)
    access.not_sent(5.2)
    assert first_start(access, 3.9) == first_start(twin, 3.9)


def test_backoffs_are_counted():
    access = make(1, persist=0.05)
    for i in range(1, 50):
        first_start(access, 10.0 * i)
    assert access.state.startswith("csma: DWAIT 3 ms, SLOTTIME 2 ms, PERSIST 0.05; 4")


def test_none_sends_at_any_time_and_keeps_no_schedule():
    free = Free()
    free.sent(9.0, None)
    for sensed in (Sensed(), Sensed(1.0, 5.0)):
        assert free.slot(Wish(2.0, Qos.BULK, 0.5, sensed)) == Slot(2.0)
    assert free.slot(Wish(2.0, Qos.BULK, 0.5, Sensed())).late_end == float("inf")
    assert (free.frame(1.0), free.notices(1.0)) == (None, [])
