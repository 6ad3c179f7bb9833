"""A burst respects its slot: its last moment, and what may be added to it."""

from collections import Counter

import pytest

from sdrlinkd.link import Outcome, Overrides, Qos, RateParams
from sdrlinkd.link.access import Slot
from sdrlinkd.wire import Frame
from tests.link.doorkeeper import Doorkeeper
from tests.link.radios import LOCKSTEP, params
from tests.link.world import PDU_S, make_link, most_pdus, next_burst, records_in, use

SIZE = 64


def test_a_burst_may_begin_late_as_long_as_it_is_over_in_time():
    link = make_link(pdu_size=SIZE, greedy=False)
    for i in range(4):
        link.submit(0, bytes([i]) * 20, 0.0)
    use(link, Doorkeeper(Slot(0.5, 0.502, 0.6), Slot(0.7, 0.702, 0.7015), Slot(0.9)))
    first = next_burst(link, 0.5)
    assert (len(first.pdus), first.latest) == (2, pytest.approx(0.598))
    link.confirm(first, Outcome.LATE, 0.6)
    # A burst that would not end in time if late may only start at its exact time.
    again = next_burst(link, 0.7)
    assert (again.number, again.latest) == (first.number, 0.7)
    link.confirm(again, Outcome.SENT, 0.7)
    assert next_burst(link, 0.9).latest == float("inf")


def test_a_burst_that_tells_the_schedule_leaves_at_its_moment():
    """Otherwise listeners would set their clocks wrong."""
    link = make_link(pdu_size=SIZE, beacon_s=0.5)
    # So short a slot cannot be reused, so its owner may start late.
    tdma = params("tdma", [1], slot_s=0.02, minislot_s=0.02)
    link.attach(LOCKSTEP._replace(longest_burst_s=(0.01,)), tdma, RateParams())
    told = []
    for i in range(4000):
        now = 5 + 1e-3 * i
        if i % 7 == 0:
            link.submit(0, bytes(20), now)
        burst = next_burst(link, now)
        if burst is None:
            continue
        link.confirm(burst, Outcome.SENT, now)
        tells = any(isinstance(r, Frame) for pdu in burst.pdus for r in records_in(pdu, SIZE))
        told.append((tells, burst.latest > burst.start))
    assert (True, True) not in told
    assert {(True, False), (False, True)} <= set(told)


def test_a_slot_is_used_to_its_end_while_messages_wait():
    """However many periodic messages are foreseen: what is kept free in a slot is lost."""
    link, slot_s = make_link(pdu_size=SIZE, greedy=False), 4.1 * PDU_S
    tdma = params("tdma", [1, 2, 3], slot_s=slot_s, guard_s=0.1 * PDU_S, minislot_s=slot_s)
    link.attach(LOCKSTEP._replace(longest_burst_s=(3 * PDU_S,)), tdma, RateParams())
    free_at, due, n_pdus = 0.0, [5.0, 5.001], Counter()
    for i in range(20_000):
        now = 5 + i * PDU_S / 8
        for topic, period in enumerate((20.9, 31.3)):
            if due[topic] <= now:
                link.submit(topic, bytes(20), now, Overrides(qos=Qos.LATENCY))
                due[topic] += period * PDU_S
        if i % 12 == 0:
            link.submit(2, bytes(40), now, Overrides(qos=Qos.BULK))
        burst = next_burst(link, now) if now >= free_at else None
        if burst is not None:
            free_at = burst.start + burst.airtime_s
            n_pdus[burst.start // (3 * slot_s)] += len(burst.pdus)
            link.confirm(burst, Outcome.SENT, free_at)
    # Four fit; one less, as a burst that begins when its robot is asked next wastes part of it.
    assert len(n_pdus) > 150
    assert set(list(n_pdus.values())[1:-1]) <= {3, 4}


@pytest.mark.parametrize("least", Qos)
def test_who_has_the_air_for_being_urgent_keeps_it_for_nothing_less(least):
    link = make_link(pdu_size=SIZE, greedy=False)
    for i in range(4):
        for qos in reversed(Qos):
            link.submit(0, bytes([i]) * 30, 0.0, Overrides(qos=qos))
    use(link, Doorkeeper(Slot.exact(0.5, 0.54, least)))
    burst = next_burst(link, 0.5)
    assert [message.qos for (message,) in burst.carried] == sorted(
        [qos for qos in Qos if qos <= least] * 4
    )[: most_pdus(0, 0.04)]


def test_the_first_is_always_taken():
    link = make_link(pdu_size=SIZE, greedy=False)
    for _ in range(3):
        link.submit(0, bytes(40), 0.0, Overrides(qos=Qos.BULK))
    use(link, Doorkeeper(Slot.exact(0.5, least=Qos.URGENT)))
    assert len(next_burst(link, 0.5).pdus) == 1
