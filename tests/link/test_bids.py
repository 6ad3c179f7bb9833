"""Where the air goes by auction, the first PDU of each burst tells what its robot wants next."""

from typing import NamedTuple

import msgspec
import pytest

from sdrlinkd.errors import ConfigError
from sdrlinkd.link import ClassesParams, Opportunity, Outcome, Overrides, Qos, RateParams, Sensed
from sdrlinkd.link.access import waiting_of
from sdrlinkd.wire import Want, equal_payload, parse
from tests.link.pulsing import FAST
from tests.link.radios import params
from tests.link.world import make_link, records_in, tell


class NamedBurst(NamedTuple):
    """A burst of which only times are known."""

    start: float
    airtime_s: float


PDU_S = 0.0005
SIZE = 256
RADIO = FAST._replace(pdu_burst_s=(PDU_S,), longest_burst_s=(0.004,), react_s=1e-4)


def airtime_s(_mcs, n):
    return n * PDU_S


def most_pdus(_mcs, longest_s):
    return int(min(8, longest_s / PDU_S + 1e-6))


def make(own_id=1, n=3, **more):
    link = make_link(own_id, pdu_size=SIZE, **more)
    link.attach(RADIO, params("auction", range(1, n + 1)), RateParams())
    return link


def bursts_of(link, begin=1.0, seconds=0.2):
    """What a robot sends that hears nobody else, with pulses."""
    found, now, free_at, idle_since = [], begin, begin, begin - 0.05
    while now < begin + seconds:
        if now >= free_at:
            sensed = Sensed(now, idle_since, None, idle_since, None)
            opportunity = Opportunity(now + RADIO.lead_s, airtime_s, most_pdus, sensed)
            burst = link.next_burst(opportunity)
            if burst is not None:
                found.append(burst)
                free_at = burst.start + burst.airtime_s + RADIO.gap_s
                link.confirm(burst, Outcome.SENT, burst.start + burst.airtime_s)
        now += 1e-4
    return found


def wait_after(link, burst):
    """Time from the end of a burst of another robot until a robot sends a pulse."""
    end = now = burst.start + burst.airtime_s
    while now < end + 0.1:
        sensed = Sensed(now, end, burst.start, end, burst.start)
        found = link.next_burst(Opportunity(now + RADIO.lead_s, airtime_s, most_pdus, sensed))
        if found is not None:
            return found.start - end
        now += 1e-4
    raise AssertionError("it waits for ever")


def wants_of(burst):
    return [
        [each for each in records_in(pdu, SIZE) if isinstance(each, Want)] for pdu in burst.pdus
    ]


def test_the_first_pdu_tells_what_is_left():
    link = make()
    link.submit(0, bytes(4000), 1.0)
    link.submit(1, bytes(100), 1.0, Overrides(qos=Qos.LATENCY))
    bursts = [each for each in bursts_of(link) if not each.is_pulse]
    assert len(bursts) > 1
    told = []
    for burst in bursts:
        first, *rest = wants_of(burst)
        assert len(first) == 1
        assert not any(rest)
        assert first[0].node == 1
        told.append(waiting_of(first[0]))
    assert all(each.qos is Qos.DEFAULT for each in told[:-1])
    assert told[-1] is None, "nothing is left"
    left = [each.all_s for each in told[:-1]]
    assert left == sorted(left, reverse=True)


def test_nothing_is_lost_by_the_room_that_it_takes():
    link, other = make(1), make(2)
    payloads = [bytes([n]) * n * 37 for n in range(1, 60)]
    for payload in payloads:
        link.submit(0, payload, 1.0)
    got = []
    for burst in bursts_of(link, seconds=1.0):
        for pdu in burst.pdus:
            got += other.hear(pdu, burst.start, 20.0, burst.start + burst.airtime_s)
    assert sorted(bytes(each.payload) for each in got) == sorted(payloads)


def test_a_message_that_has_begun_goes_on_when_the_policy_changes():
    link = make_link(1, pdu_size=SIZE)
    free = RADIO._replace(is_lockstep=False)
    link.attach(free, params("none", []), RateParams())
    link.submit(0, bytes(3000), 0.05)
    begun = link.next_burst(Opportunity(0.1, airtime_s, lambda *_: 2))
    link.confirm(begun, Outcome.SENT, 0.1)
    link.attach(RADIO._replace(is_lockstep=False), params("auction", [1, 2]), RateParams())
    other, got = make(2), []
    for burst in [begun, *bursts_of(link, 0.2)]:
        for pdu in burst.pdus:
            got += other.hear(pdu, burst.start, 20.0, burst.start + burst.airtime_s)
    assert [len(each.payload) for each in got] == [3000]


def test_what_is_told_to_another_robot_concerns_us_too():
    link, other = make(1), make(3)
    link.submit(0, bytes(4000), 1.0, Overrides(dst=2))
    (first, *_) = [each for each in bursts_of(link) if not each.is_pulse]
    assert parse(first.pdus[0], SIZE).dst == 2
    other.hear(first.pdus[0], first.start, 20.0, first.start + 0.01)
    waits = []
    for robot in (other, make(3)):
        robot.submit(0, bytes(20), first.start, Overrides(qos=Qos.BULK))
        waits.append(wait_after(robot, first))
    # Robot 1 has something more urgent, so robot 3 leaves it the first round.
    assert waits[0] > waits[1]


def test_a_pulse_is_airtime_and_no_burst():
    link = make()
    link.submit(0, bytes(20), 1.0, Overrides(qos=Qos.URGENT))
    pulses = [each for each in bursts_of(link) if each.is_pulse]
    assert pulses
    assert {each.airtime_s for each in pulses} == {RADIO.pulse_s}
    report = link.report(2.0)
    assert report.tx.bursts_sent == 1
    assert report.control_airtime_s >= len(pulses) * RADIO.pulse_s


def test_without_records_there_is_no_auction():
    topics = [(f"t{n}", "std_msgs/msg/Byte") for n in range(16)]
    link = make_link(1, topics=topics, pdu_size=SIZE)
    with pytest.raises(ConfigError, match="16 topics"):
        link.attach(RADIO, params("auction", [1, 2]), RateParams())


def test_nobody_speaks_for_another_robot():
    """Robot 2 says that robot 1 wants something urgent, and robot 3 has something urgent."""
    waits = []
    for node in (1, 2):
        link = make(3)
        tell(link, 2, Want(node, Qos.URGENT, 127, 0, 50, 0), at=1.0)
        link.submit(0, bytes(20), 1.0, Overrides(qos=Qos.URGENT))
        burst = NamedBurst(1.0 - PDU_S, PDU_S)
        waits.append(wait_after(link, burst))
    assert waits[0] < waits[1]


@pytest.mark.parametrize("size", [32, 36, 48, 51])
def test_a_pdu_has_room_for_a_want_and_a_message(size):
    with pytest.raises(ConfigError, match=r"link\.pdu_size: got .* at least 52"):
        make_link(1, pdu_size=size).attach(RADIO, params("auction", [1, 2]), RateParams())


def test_small_pdus_with_parity_carry_all():
    classes = msgspec.convert({"bulk": {"parity": 0.3}}, ClassesParams)
    link, other = make_link(1, pdu_size=52, classes=classes), make_link(2, pdu_size=52)
    link.attach(RADIO, params("auction", [1, 2]), RateParams())
    link.submit(0, bytes(900), 1.0, Overrides(qos=Qos.BULK))
    got = []
    for burst in bursts_of(link, seconds=2.0):
        for pdu in burst.pdus:
            got += other.hear(pdu, burst.start, 20.0, burst.start + burst.airtime_s)
    assert [len(each.payload) for each in got] == [900]


def test_each_pdu_keeps_12_octets_free():
    """As the documents say, also those that have no WANT."""
    link = make()
    link.submit(0, bytes(4000), 1.0)
    first = next(each for each in bursts_of(link) if not each.is_pulse)
    free = {equal_payload(SIZE, 1) - len(parse(pdu, SIZE).entries[0].payload) for pdu in first.pdus}
    assert free == {12}
