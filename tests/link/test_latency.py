"""The source of a message's age, and the cost of control records."""

from itertools import pairwise
from random import Random

import pytest

from sdrlinkd.link import AccessParams, ClockParams, Outcome, PduLinkTraits, RateParams
from sdrlinkd.link.receive import Latency, Parts
from sdrlinkd.wire import SEQ, Clock, Waits, equal_payload
from tests.link.world import (
    PDU_S,
    compose,
    make_link,
    next_burst,
    received,
    records_in,
    tell,
    topic_of,
)

SEED = 4


def test_the_parts_make_up_the_age():
    sender, receiver = make_link(own_id=1, pdu_size=64), make_link(own_id=2, pdu_size=64)
    payload = b"\0\1\0\0" + bytes(150)
    sender.submit(0, payload, 1.0)
    heard, at = [], 1.004
    while burst := compose(sender, at, 1):
        for pdu in burst.pdus:
            heard += receiver.hear(pdu, at, None, at + 0.0025, at + 0.002)
        at += 0.01
    (message,) = heard
    now = message.ended_at + 0.0005
    parts = message.parts(now)
    n = round((message.heard_at - 1.004) / 0.01)
    assert n >= 2
    assert parts == pytest.approx((0.004, 0.01 * n, 0.002, 0.0005))
    assert receiver.delivered(message, now) == pytest.approx(sum(parts))
    assert sum(parts) == pytest.approx(now - 1.0)
    (report,) = receiver.report(now).received
    told = report.latency
    assert (told.wait_ms, told.air_ms) == pytest.approx((4.0, 2.0))
    assert told.queue_ms is None, "the source has not told"


def test_percentiles_period_and_jitter_are_those_of_the_messages():
    rng, latency, now = Random(SEED), Latency(), 0.0
    ages, intervals = [], []
    for _ in range(256):
        intervals.append(rng.uniform(0.01, 0.03))
        now += intervals[-1]
        ages.append(rng.expovariate(100))
        latency.add(Parts(ages[-1], 0.0, 0.0, 0.0), now)
        assert latency.last_ms() == pytest.approx(1e3 * ages[-1])
    ages.sort()
    told = latency.percentiles_ms()
    assert told["50"] == pytest.approx(1e3 * ages[127], rel=0.02)
    assert told["99"] == pytest.approx(1e3 * ages[252], rel=0.02)
    assert told["max"] == pytest.approx(1e3 * ages[-1], rel=0.02)
    mean_ms, std_ms = latency.period_ms()
    rest = intervals[1:]
    assert mean_ms == pytest.approx(1e3 * sum(rest) / 255)
    mean = sum(rest) / 255
    assert std_ms == pytest.approx(1e3 * (sum((x - mean) ** 2 for x in rest) / 255) ** 0.5)


@pytest.mark.parametrize("age_s", [-0.001, 0.0, 1e9])
def test_an_age_that_cannot_be_has_its_place_in_the_histogram_too(age_s):
    latency = Latency()
    latency.add(Parts(age_s, 0.0, 0.0, 0.0), 0.0)
    assert latency.percentiles_ms()["max"] >= 0


def test_why_a_message_waited_is_told_in_a_beacon():
    link = make_link(beacon_s=0.5)
    link.attach(PduLinkTraits(lead_s=0.002), AccessParams(), RateParams())
    link.submit(0, bytes(20), 0.0)
    # The radio could accept it at 10 ms, and its burst left 30 ms later than planned.
    burst = next_burst(link, 0.012)
    link.confirm(burst._replace(start=0.042), Outcome.SENT, 0.05)
    waits = topic_of(link, 0)
    assert (waits.queue_ms, waits.access_ms, waits.again_ms) == pytest.approx((10, 2, 30))
    link.submit(1, bytes(20), 0.6)
    records = [each for pdu in next_burst(link, 0.6).pdus for each in records_in(pdu, len(pdu))]
    told = [each for each in records if isinstance(each, Waits)]
    assert told == [Waits(0, 61, 12, 182)]


def test_what_a_source_tells_of_its_waits_splits_the_wait_of_its_messages():
    sender, receiver = make_link(1), make_link(2)
    sender.submit(0, bytes(20), 0.0)
    burst = compose(sender, 0.1)
    # Unknown topic numbers are useless, but harmless.
    useless = [Waits(topic_id, 1, 2, 3) for topic_id in range(16)]
    for behind, told in (2, useless), (1, [Waits(0, 60, 20, 20)]):
        tell(receiver, 1, *told, at=0.0, number=(burst.pdus[0][SEQ] - behind) & 0xFF)
    for pdu in burst.pdus:
        for message in receiver.hear(pdu, 0.1):
            receiver.delivered(message, 0.1)
    told = received(receiver)[1, 0].latency
    assert (told.wait_ms, told.queue_ms, told.access_ms) == pytest.approx((100, 60, 20))


def clocks_of(link, until, step_s=0.01, submit_s=None):
    """(time, whether it was alone) of each CLOCK sent, with robot 9 present."""
    found, now, next_at = [], 0.0, 0.0
    while now < until:
        now += step_s
        if submit_s is not None and now >= next_at:
            next_at += submit_s
            link.submit(0, bytes(20), now)
        tell(link, 9, at=now)
        link.handle_timers(now)
        while burst := next_burst(link, now):
            link.confirm(burst, Outcome.SENT, now + PDU_S)
            for pdu, carried in zip(burst.pdus, burst.carried, strict=True):
                if any(isinstance(each, Clock) for each in records_in(pdu, len(pdu))):
                    found.append((now, not carried))
                    assert burst.clock is not None
    return found


@pytest.mark.slow
def test_clocks_ride_at_their_period_and_go_alone_within_their_share():
    alone = make_link(clock=ClockParams(period_s=0.2, share=0.004))
    alone.attach(PduLinkTraits(pdu_burst_s=(PDU_S,)), AccessParams(), RateParams())
    times = [at for at, is_alone in clocks_of(alone, 20.0) if is_alone]
    gaps = [later - earlier for earlier, later in pairwise(times)]
    # Two robots, 1 ms each: 2 ms / 0.004, and a twentieth more.
    assert all(0.52 < gap < 0.54 for gap in gaps), gaps
    assert alone.report(0.0).control_airtime_s <= 20 * 0.004 / 2 + PDU_S
    beside = make_link(clock=ClockParams(period_s=0.2, share=0.004))
    beside.attach(PduLinkTraits(pdu_burst_s=(PDU_S,)), AccessParams(), RateParams())
    found = clocks_of(beside, 20.0, submit_s=0.05)
    # They may piggyback from three quarters of their period on.
    assert 85 < len(found) <= 20 / 0.15 + 1
    assert not any(is_alone for _, is_alone in found[1:])


def test_a_robot_that_is_alone_does_not_tell_its_clock():
    link = make_link(clock=ClockParams(), beacon_s=1.0)
    for i in range(300):
        link.handle_timers(i * 0.01)
        while burst := next_burst(link, i * 0.01):
            link.confirm(burst, Outcome.SENT, i * 0.01)
            assert burst.clock is None
            records = [each for pdu in burst.pdus for each in records_in(pdu, len(pdu))]
            assert not any(isinstance(each, Clock) for each in records)


def test_on_small_pdus_clocks_tell_of_as_many_robots_as_there_is_room_for():
    link = make_link(pdu_size=64, clock=ClockParams())
    for src in range(2, 12):
        tell(link, src, Clock(1, 1, 1, 1), at=0.5)
    found = clocks_of(link, 3.0)
    assert len(found) > 5
    tiny = make_link(pdu_size=32, clock=ClockParams())
    assert clocks_of(tiny, 3.0) == []
    assert any("have no room for CLOCK" in notice for notice in tiny.notices(0.0))
    assert tiny.next_wakeup(3.0) > 3.0
    without = make_link(pdu_size=32, clock=ClockParams(period_s=0.0))
    assert not any("CLOCK" in notice for notice in without.notices(0.0))


def test_a_stamp_that_goes_ahead_is_no_record_alone():
    link = make_link(pdu_size=64, clock=ClockParams())
    size = equal_payload(64, 1)
    link.submit(0, bytes(size), 0.0)
    burst = next_burst(link, 0.0)
    assert len(burst.pdus) == 2
    assert (burst.n_records, link.report(0.0).control_airtime_s) == (0, 0.0)


def test_a_robot_that_hears_itself_does_not_follow_its_own_clock():
    link = make_link(1, clock=ClockParams(), hears_self=True)
    for src in (1, 2):
        tell(link, src, Clock(7, 1, 1, 1), at=0.5)
    clocks = {each.src: each.clock for each in link.report(1.0).neighbors}
    assert clocks[1] is None
    assert clocks[2] is not None
