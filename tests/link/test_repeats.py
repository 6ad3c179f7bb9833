"""PDUs that were lost are asked for and sent again; ages stay true, and nothing comes twice."""

from collections import Counter
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import (
    ClassesParams,
    DefaultParams,
    Opportunity,
    Overrides,
    Qos,
    RelayParams,
    TopicPolicy,
    UrgentParams,
)
from sdrlinkd.wire import Need, Repeat
from tests.laws import law
from tests.link.lossy import Air, carries, once
from tests.link.world import (
    airtime_s,
    neighbors,
    rx,
    tell,
)


def test_what_is_lost_comes_after_all_with_its_true_age():
    air = Air(lost=once(50, 51, 60))
    air.flow(1, 100)
    air.run(air.now + 0.5)
    assert sorted(air.numbers(2)) == list(range(100))
    for _, number, age_s, told_s in air.got:
        assert told_s == pytest.approx(age_s, abs=3e-3)
        assert (age_s > 0.01) == (number in (50, 51, 60))
    report = neighbors(air.links[2])[1]
    assert (report.pdus_lost, report.pdus_repaired) == (0, 3)
    needs = [record for _, record in air.records(2) if isinstance(record, Need)]
    assert sum(len(need.numbers()) for need in needs) == 3
    repeats = [record for _, record in air.records(1) if isinstance(record, Repeat)]
    assert sum(repeat.n_pdus for repeat in repeats) == 3


def test_every_octet_is_as_at_first():
    air = Air(lost=once(50))
    air.flow(1, 60)
    air.run(air.now + 0.5)
    sent = [pdu for _, src, burst in air.bursts if src == 1 for pdu in burst.pdus]
    with_it = [pdu for pdu in sent if carries(50)(pdu)]
    assert len(with_it) == 2
    assert with_it[0] == with_it[1]


def test_without_a_share_nothing_is_asked_or_repeated():
    air = Air(lost=once(50), share=0.0)
    air.flow(1, 60)
    air.run(air.now + 0.5)
    assert 50 not in air.numbers(2)
    told = [type(record) for src in (1, 2) for _, record in air.records(src)]
    assert not {Need, Repeat} & set(told)


def test_the_last_pdu_is_missed_by_the_next_clock():
    air = Air(lost=once(59))
    air.flow(1, 60)
    air.run(air.now + 1.0)
    assert 59 in air.numbers(2)


def test_a_lost_repetition_is_asked_for_again_three_times_at_most():
    tries = Counter()

    def lost(_to, src, _n, pdu):
        if src == 1 and carries(50)(pdu):
            tries[50] += 1
            return True
        return False

    air = Air(lost=lost)
    air.flow(1, 200)
    assert 50 not in air.numbers(2)
    assert tries[50] == 4
    assert neighbors(air.links[2])[1].pdus_lost == 1


def test_what_has_outlived_its_lifespan_is_not_repeated():
    air = Air(lost=once(50))
    air.flow(1, 60, overrides=Overrides(lifespan_s=0.015))
    air.run(air.now + 0.5)
    assert 50 not in air.numbers(2)
    assert air.links[1].report(air.now).repeats.pdus == 0
    assert air.links[1].report(air.now).repeats.expired > 0


def test_what_is_for_another_robot_is_not_repeated_for_this_one():
    air = Air((1, 2, 3), lost=lambda to, src, n, pdu: to == 3 and src == 1 and carries(50)(pdu))
    air.flow(1, 80, overrides=Overrides(dst=2))
    air.run(air.now + 0.3)
    assert air.links[1].report(air.now).repeats.pdus == 0


def test_one_repetition_serves_all_who_lack_it():
    air = Air((1, 2, 3), lost=once_for_all(50))
    air.flow(1, 100)
    air.run(air.now + 0.5)
    assert 50 in air.numbers(2)
    assert 50 in air.numbers(3)
    assert air.links[1].report(air.now).repeats.pdus == 1
    asked = sum(air.links[robot].report(air.now).repeats.asked for robot in (2, 3))
    assert asked in (1, 2)


def once_for_all(number):
    """Loses the first transmission of a message for all robots."""
    seen = Counter()

    def lost(to, src, _n, pdu):
        if src != 1 or not carries(number)(pdu):
            return False
        seen[to] += 1
        return seen[to] == 1

    return lost


@pytest.mark.slow
def test_a_relay_repeats_what_its_neighbour_lacks():
    chain = {(2, 1), (1, 2), (3, 2), (2, 3)}
    relay = RelayParams(policy="flood")
    seen = Counter()

    def lost(to, src, _n, pdu):
        if (to, src) != (3, 2) or pdu[1] != 1 or not carries(50)(pdu):
            return False
        seen[to] += 1
        return seen[to] == 1

    air = Air((1, 2, 3), lost=lost, hears=chain, relay=relay, hop_limit=2)
    air.flow(1, 100, every_s=0.02)
    air.run(air.now + 0.5)
    assert sorted(air.numbers(3)) == list(range(100))
    assert air.links[2].report(air.now).repeats.pdus == 1
    assert air.links[1].report(air.now).repeats.pdus == 0
    for _, _, age_s, told_s in air.got:
        assert told_s == pytest.approx(age_s, abs=3e-3)


@pytest.mark.slow
def test_a_relay_lacks_pdus_too_and_their_ages_stay_true():
    chain = {(2, 1), (1, 2), (3, 2), (2, 3)}
    air = Air((1, 2, 3), lost=once(50), hears=chain, relay=RelayParams(policy="flood"), hop_limit=2)
    air.flow(1, 100, every_s=0.02)
    air.run(air.now + 0.5)
    assert sorted(air.numbers(3)) == list(range(100))
    for _, _, age_s, told_s in air.got:
        assert told_s == pytest.approx(age_s, abs=3e-3)


@pytest.mark.slow
def test_fragments_come_again_while_their_message_is_waited_for():
    air = Air(lost=lambda to, src, n, pdu: src == 1 and n % 7 == 0)
    air.run(1.1)
    air.flow(1, 20, every_s=0.1, size=2000)
    air.run(air.now + 0.6)
    assert sorted(air.numbers(2)) == list(range(20))


@pytest.mark.slow
@pytest.mark.parametrize("parity", [0.0, 0.2])
def test_what_is_lost_inside_a_long_message_comes_though_that_one_is_complete(parity):
    """An urgent message goes between two bursts of a long one; each time, all of it is lost."""
    urgent = Overrides(qos=Qos.URGENT)
    classes = ClassesParams(default=DefaultParams(parity=parity))
    air = Air(lost=once(*range(100, 120)), classes=classes)
    air.run(1.1)
    for number in range(20):
        air.submit(1, number, size=6000)
        air.run(air.now + 0.002)
        air.submit(1, 100 + number, overrides=urgent)
        air.run(air.now + 0.2)
    assert sorted(air.numbers(2)) == [*range(20), *range(100, 120)]


@pytest.mark.slow
def test_parity_that_repairs_a_message_spares_the_question():
    lost_every = 23
    params = {"classes": ClassesParams(default=DefaultParams(parity=0.2))}
    air = Air(lost=lambda to, src, n, pdu: src == 1 and n % lost_every == 0, **params)
    air.flow(1, 30, every_s=0.1, size=2000)
    air.run(air.now + 0.6)
    assert sorted(air.numbers(2)) == list(range(30))
    lost = neighbors(air.links[2])[1].pdus_lost
    assert air.links[2].report(air.now).repeats.asked < 0.3 * lost


def test_urgent_messages_of_a_short_life_are_sent_twice_if_wanted():
    params = {"classes": ClassesParams(urgent=UrgentParams(twice=True))}
    urgent = Overrides(qos=Qos.URGENT, lifespan_s=0.05)
    air = Air(lost=once(*range(10, 50)), **params)
    air.flow(1, 60, every_s=0.02, overrides=urgent)
    assert sorted(air.numbers(2)) == list(range(60))
    for _, _, age_s, told_s in air.got:
        assert told_s == pytest.approx(age_s, abs=3e-3)
        assert age_s < 0.02
    assert air.links[1].report(air.now).repeats.pdus == 60


@pytest.mark.slow
def test_questions_for_nothing_get_nothing_and_are_counted():
    air = Air((1, 2))
    air.flow(1, 50)
    link = air.links[1]
    before = link.report(air.now).repeats
    for asker in range(3, 40):
        for first in range(0, 1 << 20, 1 << 14):
            tell(link, asker, Need(1, first, b"\xff" * 16), at=air.now)
    after = link.report(air.now).repeats
    assert after.asked_of_us - before.asked_of_us == 37 * 64 * 128
    assert after.unknown - before.unknown > 37 * 63 * 128
    air.run(air.now + 1.0)
    report = link.report(air.now).repeats
    assert report.airtime_s < 0.05 * 1.0 + 0.07


def test_a_repeat_that_cannot_be_true_is_not_used():
    air = Air()
    air.flow(1, 20)
    link = air.links[2]
    before = rx(link).control_bad
    for nonsense in (Repeat(1, 5, 0xFFFF, 1), Repeat(1, 5, 10, 0), Repeat(1, 5, 10, 64)):
        tell(link, 1, nonsense, at=air.now)
    assert rx(link).control_bad == before + 3


@pytest.mark.slow
@law(40)
@given(st.integers(0, 1000), st.floats(0, 0.3), st.sampled_from([40, 400]), st.booleans())
def test_nothing_comes_twice_and_no_age_is_too_low(seed, loss, size, is_relayed):
    """No age is too low, if anything that was sent since tells a repetition from a new PDU."""
    rng, every_s, error_s = Random(seed), 0.02, 3e-3
    params = {"relay": RelayParams(policy="flood"), "hop_limit": 2} if is_relayed else {}
    heard_at = {robot: [] for robot in (1, 2, 3)}

    def lost(to, _src, _n, pdu):
        is_lost = rng.random() < loss
        if not is_lost and pdu[1] == 1:
            heard_at[to].append(air.now)
        return is_lost

    air = Air((1, 2, 3), lost=lost, share=0.3, **params)
    for link in air.links.values():
        link.set_policy(0, TopicPolicy(lifespan_s=2.0))
    air.flow(1, 100, every_s=every_s, size=size)
    air.run(air.now + 1.0)
    assert max(Counter((robot, number) for robot, number, *_ in air.got).values()) == 1
    for robot, number, age_s, told_s in air.got:
        sent_at = air.sent_at[number]
        since = [at for at in heard_at[robot] if every_s < at - sent_at < age_s - error_s]
        assert told_s is None or told_s > age_s - error_s or not since
    assert not [line for link in air.links.values() for line in link.audit()]


def test_what_was_lost_before_a_number_was_told_is_asked_for_too():
    air = Air(lost=once(3, 5), beacon_s=0.0)
    air.flow(1, 40, size=90)
    air.run(air.now + 0.5)
    assert sorted(air.numbers(2)) == list(range(40))


def test_where_a_burst_has_one_pdu_the_announcement_goes_ahead():
    air = Air(lost=once(50, 51))

    def one_pdu(link, now):
        return link.next_burst(Opportunity(now, airtime_s, lambda _mcs, _s: 1))

    air.next_burst = one_pdu
    air.flow(1, 100)
    air.run(air.now + 0.5)
    assert sorted(air.numbers(2)) == list(range(100))
    assert max(len(burst.pdus) for _, _, burst in air.bursts) == 1
    for _, _, age_s, told_s in air.got:
        assert told_s == pytest.approx(age_s, abs=3e-3)
    assert neighbors(air.links[2])[1].pdus_repaired == 2
