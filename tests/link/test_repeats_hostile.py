"""Repeats where others lie, where radios are late, and where entry ids are used again."""

import pytest

from sdrlinkd.link import ClassesParams, DefaultParams, Outcome, RepeatParams
from sdrlinkd.wire import Need, Parity, Repeat, leaves_later, needs
from tests.link.lossy import PDU_SIZE, Air, message, once
from tests.link.world import make_link, neighbors, next_burst, records_in, tell


def asked(link, numbers, at, asker=2):
    for need in needs(1, numbers):
        tell(link, asker, need, at=at)


def sender(**params):
    return make_link(1, **{"pdu_size": PDU_SIZE, "repeat": RepeatParams(), **params})


def sent(link, at, n=1, **kinds):
    """Submit and send messages; the bursts."""
    bursts = []
    for i in range(n):
        link.submit(0, message(i, **kinds), at)
        while burst := next_burst(link, at):
            link.confirm(burst, Outcome.SENT, at)
            bursts.append(burst)
    return bursts


def test_what_is_too_old_to_be_repeated_waits_no_longer():
    link = sender()
    (burst,) = sent(link, 0.0)
    asked(link, burst.numbers, 0.1)
    assert link.next_wakeup(0.2) <= 0.2
    assert next_burst(link, 1.5) is None
    assert link.next_wakeup(1.5) > 1.5, "nothing spins"
    assert link.report(1.5).repeats.unknown == 1


@pytest.mark.parametrize("with_parity", [False, True])
def test_nothing_under_an_entry_id_that_another_message_uses_is_repeated(with_parity):
    classes = ClassesParams(default=DefaultParams(parity=0.3 * with_parity))
    link = sender(classes=classes)
    bursts = sent(link, 0.0, size=600)
    numbers = [number for burst in bursts for number in burst.numbers]
    parity = [
        number
        for burst in bursts
        for number, pdu in zip(burst.numbers, burst.pdus, strict=True)
        if any(isinstance(record, Parity) for record in records_in(pdu, PDU_SIZE))
    ]
    assert bool(parity) == with_parity
    # All 256 entry ids are used until the first one is free again.
    for i in range(256):
        sent(link, 0.65 + 1e-4 * i, size=600)
    asked(link, parity or numbers, 0.7)
    while burst := next_burst(link, 0.71):
        assert burst.repeated is None
        link.confirm(burst, Outcome.SENT, 0.71)
    assert link.next_wakeup(0.72) > 0.72, "nothing spins"


def test_repeats_of_others_that_cannot_be_true_cost_nothing():
    link = sender()
    tell(link, 9, at=0.0)
    for i in range(50):
        tell(link, 9, Repeat(9, i, 1, 255), Repeat(3, i, 1, 63), at=0.01 * i)
    (burst,) = sent(link, 1.0)
    asked(link, burst.numbers, 1.01)
    again = next_burst(link, 1.03)
    assert again is not None
    assert again.repeated is not None


def test_no_robot_takes_all_places():
    link = sender(has_numbers=False)
    bursts = sent(link, 0.0, n=400)
    numbers = [number for burst in bursts for number in burst.numbers]
    asked(link, numbers[-99:], 0.01, asker=9)
    asked(link, numbers[-98:], 0.01, asker=9)
    before = link.report(0.0).repeats.refused
    asked(link, numbers[-1:], 0.02, asker=2)
    assert link.report(0.0).repeats.refused == before


def test_who_got_least_comes_first():
    """Though it lacks a later PDU, and not all fit into the burst."""
    link = sender(repeat=RepeatParams(share=1.0))
    numbers = [number for burst in sent(link, 0.0, n=40) for number in burst.numbers]

    def repeated(at):
        again = next_burst(link, at)
        link.confirm(again, Outcome.SENT, at)
        return [kept.number for kept in again.repeated.kept]

    asked(link, numbers[:1], 0.01, asker=2)
    assert repeated(0.05) == numbers[:1]
    asked(link, numbers[1:30], 0.06, asker=2)
    asked(link, numbers[35:36], 0.06, asker=3)
    first = repeated(0.1)
    assert 1 < len(first) < 29
    assert first == [*numbers[1 : len(first)], numbers[35]]


def test_questions_of_others_do_not_use_up_ours():
    air = Air((1, 2, 3), lost=once(50))
    air.flow(1, 52)
    missing = neighbors(air.links[2])[1].pdus_lost
    assert missing == 1
    for _ in range(5):
        tell(air.links[2], 3, Need(1, 0, b"\xff" * 16), Need(1, 128, b"\xff" * 16), at=air.now)
    air.flow(1, 40, first=52)
    air.run(air.now + 0.5)
    assert 50 in air.numbers(2)


def test_a_burst_that_left_later_is_repeated_with_its_true_age():
    link, robot = sender(beacon_s=0.5), make_link(2, pdu_size=PDU_SIZE, repeat=RepeatParams())
    for at in (0.0, 0.1):
        (burst,) = sent(link, at)[:1]
        for pdu in burst.pdus:
            robot.hear(pdu, at)
    link.submit(0, message(7), 1.0)
    burst = next_burst(link, 1.0)
    late_s = 0.04
    assert all(leaves_later(pdu, round(1e6 * late_s)) for pdu in burst.pdus)
    link.confirm(burst._replace(start=1.0 + late_s), Outcome.SENT, 1.05)
    # It is lost, and the next one shows it.
    (after,) = sent(link, 1.1)
    for pdu in after.pdus:
        robot.hear(pdu, 1.1)
    asked(link, burst.numbers, 1.2)
    again = next_burst(link, 1.22)
    assert again.repeated is not None
    link.confirm(again, Outcome.SENT, 1.22)
    delivered = [each for pdu in again.pdus for each in robot.hear(pdu, 1.22)]
    (message_again,) = delivered
    assert robot.delivered(message_again, 1.22) == pytest.approx(0.22, abs=1e-3)


def test_a_repetition_that_did_not_leave_waits_again_at_no_cost():
    link = sender()
    (burst,) = sent(link, 0.0)
    asked(link, burst.numbers, 0.01)
    for i in range(5):
        again = next_burst(link, 0.05 + 0.01 * i)
        assert again.repeated is not None
        link.confirm(again, Outcome.LATE, 0.05 + 0.01 * i)
    link.confirm(next_burst(link, 0.2), Outcome.SENT, 0.2)
    assert link.report(0.2).repeats.pdus == 1
    assert next_burst(link, 0.3) is None
