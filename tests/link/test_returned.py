"""Late bursts are sent again: in order, with higher ages, and never lost silently."""

import pytest

from sdrlinkd.link import (
    AccessParams,
    Outcome,
    Overrides,
    PduLinkTraits,
    Qos,
    RateParams,
)
from sdrlinkd.link.access import Slot
from sdrlinkd.link.transmit import GIVE_UP_S
from sdrlinkd.wire import Beacon, Frame, Stamp, parse
from tests.link.doorkeeper import Doorkeeper
from tests.link.radios import LOCKSTEP, params
from tests.link.world import PDU_S, airtime_s, make_link, next_burst, records_in, topic_of, tx, use

SIZE = 64


def records(pdu):
    return records_in(pdu, SIZE)


def without_ages(pdu):
    """A PDU without the ages in its STAMPs."""
    parsed = parse(pdu, SIZE)
    messages = [e for e in parsed.entries if e.topic_id != 15]
    kept = [r._replace(age_us=0) if isinstance(r, Stamp) else r for r in records(pdu)]
    return parsed._replace(entries=messages), kept


def stamps(burst):
    return [r.age_us for pdu in burst.pdus for r in records(pdu) if isinstance(r, Stamp)]


def test_it_goes_again_as_it_was_but_older():
    link = make_link(pdu_size=SIZE)
    link.submit(0, bytes(100), 0.0)
    first = next_burst(link, 0.25)
    link.confirm(first, Outcome.LATE, 0.3)
    assert link.audit() == []
    again = next_burst(link, 0.75)
    assert again.start == 0.75
    assert (again.mcs, again.qos, again.carried) == (first.mcs, first.qos, first.carried)
    assert [without_ages(pdu) for pdu in again.pdus] == [without_ages(pdu) for pdu in first.pdus]
    assert (stamps(first), stamps(again)) == ([250_000], [750_000])
    link.confirm(again, Outcome.SENT, 0.8)
    assert topic_of(link, 0).sent == 1
    assert link.audit() == []


def test_ages_stay_true_however_often_it_is_late():
    link, receiver = make_link(1, pdu_size=SIZE), make_link(2, pdu_size=SIZE)
    link.submit(0, bytes(30), 0.0)
    now = 0.1
    for _ in range(6):
        now += 0.123_456_7
        burst = next_burst(link, now)
        link.confirm(burst, Outcome.LATE, now)
    burst = next_burst(link, now + 0.05)
    (message,) = receiver.hear(burst.pdus[0], 77.0)
    assert receiver.delivered(message, 77.0) == pytest.approx(now + 0.05, abs=6e-6)


def test_a_tdma_phase_moves_too():
    link = make_link(pdu_size=SIZE, beacon_s=1.0)
    traits = LOCKSTEP._replace(longest_burst_s=(0.01,))
    access = link.attach(traits, params("tdma", [1]), RateParams()).settled.access

    def granted(since):
        return next(b for i in range(999) if (b := next_burst(link, since + 1e-3 * i)))

    def phase_us(burst):
        (frame,) = (r for pdu in burst.pdus for r in records(pdu) if isinstance(r, Frame))
        return frame.phase_us

    first = granted(5.0)
    link.confirm(first, Outcome.LATE, 5.0)
    again = granted(5.3)
    assert again.start > first.start + 0.2
    assert phase_us(again) - phase_us(first) == pytest.approx(
        1e6 * (again.start - first.start), abs=1
    )
    # It may exceed a frame; listeners count from its start.
    kept_us, frame_us = access.frame(again.start).phase_us, 1e6 * access.round_s
    off_us = (phase_us(again) - kept_us) % frame_us
    assert min(off_us, frame_us - off_us) < 2


def test_several_go_again_in_their_order_and_before_anything_new():
    link = make_link(pdu_size=SIZE, greedy=False)
    for i in range(40):
        link.submit(0, bytes([i]) * 20, 0.0)
    bursts = [next_burst(link, 0.01 * i) for i in range(4)]
    for i in (2, 0, 3):
        link.confirm(bursts[i], Outcome.LATE, 0.05)
    link.confirm(bursts[1], Outcome.SENT, 0.05)
    link.submit(1, bytes(8), 0.05, Overrides(qos=Qos.URGENT))

    def number(burst):
        return parse(burst.pdus[0], SIZE).seq

    first = next_burst(link, 0.1)
    assert number(first) == number(bursts[0])
    # Late once more while the others wait: it remains the first.
    link.confirm(first, Outcome.LATE, 0.11)
    order = [number(next_burst(link, 0.2 + 0.01 * i)) for i in range(4)]
    assert order[:3] == [number(bursts[i]) for i in (0, 2, 3)]
    assert order[3] not in [number(burst) for burst in bursts]


def test_it_waits_for_a_slot_that_it_fits_into_and_nothing_overtakes_it():
    link = make_link(pdu_size=SIZE, greedy=False)
    for i in range(6):
        link.submit(0, bytes([i]) * 20, 0.0)
    burst = next_burst(link, 0.0)
    length_s = airtime_s(0, len(burst.pdus))
    assert len(burst.pdus) == 6
    link.confirm(burst, Outcome.LATE, 0.1)
    door = Doorkeeper(None, Slot.exact(0.3, 0.3 + length_s / 2), Slot.exact(0.5, 0.5 + length_s))
    use(link, door)
    link.submit(1, bytes(8), 0.1, Overrides(qos=Qos.URGENT))
    assert next_burst(link, 0.2) is None
    assert next_burst(link, 0.3) is None
    assert link.next_wakeup(0.3) <= 0.3
    again = next_burst(link, 0.5)
    assert (again.start, again.latest, len(again.pdus)) == (0.5, 0.5, 6)
    assert door.told == [("sent", 0.5 + length_s)]
    link.confirm(again, Outcome.LATE, 0.5)
    assert door.told[1:] == [("not sent", 0.5)]


def test_after_a_while_it_is_given_up_by_name():
    link = make_link(pdu_size=SIZE)
    link.submit(0, bytes(30), 0.0)
    now, tries = 0.0, 0
    while (burst := next_burst(link, now)) and tries < 50:
        tries += 1
        link.confirm(burst, Outcome.LATE, now)
        assert link.audit() == []
        now += 0.3
    assert GIVE_UP_S < now < GIVE_UP_S + 1
    assert tries == round(now / 0.3)
    assert dict(topic_of(link, 0).dropped) == {"tx_radio_failed": 1}
    assert not link.has_work
    assert (tx(link).bursts_failed, tx(link).pdus_failed) == (1, 1)


def test_the_rest_of_a_message_that_is_given_up_is_not_sent():
    link = make_link(pdu_size=SIZE)
    link.submit(0, bytes(1000), 0.0)
    now = 0.0
    while (burst := next_burst(link, now)) and now < 20:
        link.confirm(burst, Outcome.LATE, now)
        now += 1.5
    assert now == 4.5
    assert dict(topic_of(link, 0).dropped) == {"tx_radio_failed": 1}
    assert link.audit() == []


@pytest.mark.parametrize("outcome", [Outcome.LOST, Outcome.UNDERFLOW])
def test_only_what_did_not_leave_at_all_goes_again(outcome):
    """Others may have heard a part of an interrupted burst: its PDUs would be duplicates."""
    link = make_link(pdu_size=SIZE)
    link.submit(0, bytes(30), 0.0)
    link.confirm(next_burst(link, 0.0), outcome, 0.1)
    assert next_burst(link, 0.2) is None
    assert dict(topic_of(link, 0).dropped) == {"tx_radio_failed": 1}


def test_shut_down_leaves_nothing_to_send():
    link = make_link(pdu_size=SIZE)
    for _ in range(3):
        link.submit(0, bytes(200), 0.0)
    burst = next_burst(link, 0.0)
    link.confirm(burst, Outcome.LATE, 0.1)
    assert link.has_work
    link.drain()
    assert link.has_work, "drained is what was sent, not what waits for a slot"
    link.shut_down()
    assert dict(topic_of(link, 0).dropped) == {"tx_shutdown": 3}
    assert link.audit() == []
    assert not link.has_work
    assert next_burst(link, 0.2) is None


def test_air_that_was_not_used_is_not_counted():
    """Reported airtime and bursts by MCS only count bursts that left."""
    link = make_link(pdu_size=SIZE)
    link.attach(PduLinkTraits(), AccessParams(), RateParams())
    link.submit(0, bytes(30), 0.0)
    for now in (0.0, 0.2, 0.4):
        burst = next_burst(link, now)
        link.confirm(burst, Outcome.LATE, now)
    link.confirm(next_burst(link, 0.6), Outcome.SENT, 0.7)
    assert link.report(0.0).bursts_late == 3
    assert link.report(0.0).airtime_s == pytest.approx(PDU_S)
    assert dict(link.report(0.0).bursts_by_mcs) == {0: 1}


def test_a_beacon_that_was_late_is_still_a_beacon():
    link = make_link(pdu_size=SIZE, beacon_s=1.0)
    first = next_burst(link, 5.0)
    link.confirm(first, Outcome.LATE, 5.0)
    again = next_burst(link, 5.2)
    assert any(isinstance(record, Beacon) for record in records(again.pdus[0]))
    link.confirm(again, Outcome.SENT, 5.2)
    assert next_burst(link, 5.3) is None
