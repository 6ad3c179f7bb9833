"""How long a partly filled PDU waits for more messages, and what never waits."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import (
    ClassesParams,
    ClassParams,
    ClockParams,
    Outcome,
    Overrides,
    Qos,
    TopicPolicy,
    flush_told,
)
from sdrlinkd.wire import ENTRY_HEADER_SIZE, Beacon, Clock, Receipt, equal_payload
from tests.laws import law
from tests.link.world import (
    compose,
    layouts,
    make_link,
    next_burst,
    records_in,
    send_all,
    topic_of,
    tx,
)

INFINITE = float("inf")
NEVER = 0.0
"""By time only, as in the paper."""
LATE = 1e6


def no_stamps(link):
    link.set_policies({i: TopicPolicy(stamp=False) for i in range(len(link.registry))})
    return link


def waiting(flush_s, **more):
    return no_stamps(make_link(pdu_size=220, flush_s=flush_s, **more))


def test_by_default_nothing_waits():
    link = no_stamps(make_link(pdu_size=220))
    link.submit(0, bytes(50), 1.0)
    assert len(compose(link, 1.0).pdus) == 1


def test_a_partial_pdu_waits_for_so_long():
    link = waiting(0.2)
    link.submit(0, bytes(50), 1.0)
    assert compose(link, 1.1) is None
    assert link.next_wakeup(1.1) == pytest.approx(1.2)
    link.submit(1, bytes(50), 1.15)
    assert len(compose(link, 1.2).pdus) == 1


def test_a_full_one_does_not():
    link = waiting(0.2)
    link.submit(0, bytes(400), 1.0)
    assert len(compose(link, 1.0, 1).pdus) == 1


@pytest.mark.parametrize("flush_s", [NEVER, INFINITE])
class TestWithoutEnd:
    def test_a_partial_pdu_never_goes_by_time(self, flush_s):
        link = waiting(flush_s)
        link.submit(0, bytes(50), 0.0)
        assert compose(link, LATE) is None
        assert next_burst(link, LATE) is None
        assert link.next_wakeup(LATE) == INFINITE

    def test_it_goes_when_it_is_full(self, flush_s):
        link = waiting(flush_s)
        # 4 × 50 B and the headers of 3 of them exceed 207 B.
        for i in range(4):
            link.submit(i % 2, bytes(50), 0.1 * i)
            burst = compose(link, 0.1 * i)
            assert (burst is None) == (i < 3)

    def test_at_the_end_it_goes(self, flush_s):
        link = waiting(flush_s)
        link.submit(0, bytes(50), 0.0)
        link.drain()
        assert link.has_work
        assert link.next_wakeup(LATE) <= LATE
        assert len(send_all(link, LATE)) == 1
        assert not link.has_work
        assert link.audit() == []

    @pytest.mark.parametrize("qos", [Qos.URGENT, Qos.LATENCY])
    def test_urgent_and_latency_never_wait(self, flush_s, qos):
        link = waiting(flush_s)
        link.submit(1, bytes(50), 0.0)
        link.submit(0, bytes(50), 0.0, Overrides(qos=qos))
        assert link.next_wakeup(0.0) <= 0.0
        # Messages that may wait fill the rest.
        assert len(layouts(compose(link, 0.0).pdus, 220)[0]) == 2

    @pytest.mark.parametrize("wish", ["policy", "message"])
    def test_a_lifespan_never_waits(self, flush_s, wish):
        link = waiting(flush_s)
        override = Overrides()
        if wish == "policy":
            link.set_policies({0: TopicPolicy(stamp=False, lifespan_s=5.0)})
        else:
            override = Overrides(lifespan_s=5.0)
        link.submit(0, bytes(50), 0.0, override)
        assert link.next_wakeup(0.0) <= 0.0
        assert len(compose(link, 0.0).pdus) == 1

    def test_a_lifespan_behind_one_of_its_own_topic_that_may_wait(self, flush_s):
        link = waiting(flush_s)
        link.submit(0, bytes(50), 0.0)
        assert compose(link, 0.0) is None
        link.submit(0, bytes(50), 0.0, Overrides(lifespan_s=1.0))
        assert layouts(compose(link, 0.0).pdus, 220) == [[(0, 0, 1, 50)] * 2]
        link.submit(0, bytes(50), 0.0)
        assert compose(link, 0.0) is None

    def test_the_rest_of_a_message_does_not_wait_until_receivers_give_it_up(self, flush_s):
        link, far = waiting(flush_s), no_stamps(make_link(2, pdu_size=220))
        link.submit(0, bytes(300), 0.0)
        got = []

        def send(now):
            if burst := compose(link, now):
                link.confirm(burst, Outcome.SENT, now)
                got.extend(message for pdu in burst.pdus for message in far.hear(pdu, now))

        send(0.0)
        assert got == []
        rest_at = link.next_wakeup(0.0)
        assert 0.0 < rest_at < 0.5
        send(rest_at)
        assert [len(each.payload) for each in got] == [300]

    def test_parity_does_not_wait_for_ever(self, flush_s):
        classes = ClassesParams(bulk=ClassParams(parity=0.3))
        link = waiting(flush_s, classes=classes)
        link.submit(0, bytes(5 * 207), 0.0, Overrides(qos=Qos.BULK))
        for now in (0.0, 0.3, 0.6, 0.9):
            if burst := compose(link, now):
                link.confirm(burst, Outcome.SENT, now)
        assert topic_of(link, 0).sent == 1
        assert not link.has_work

    def test_beacons_clocks_and_receipts_do_not_wait(self, flush_s):
        """They go even if a message in the queue waits forever."""
        clock = ClockParams(period_s=0.2, share=0.5)
        link = waiting(flush_s, beacon_s=1.0, clock=clock)
        far = make_link(2, pdu_size=220, beacon_s=1.0, clock=clock)
        link.submit(0, bytes(50), 0.0)
        told = []
        for step in range(60):
            now = step / 20
            if step == 20:
                far.submit(1, bytes(50), now, Overrides(receipt="mine"))
            for one, other in ((link, far), (far, link)):
                while burst := next_burst(one, now):
                    one.confirm(burst, Outcome.SENT, now)
                    for pdu in burst.pdus:
                        other.hear(pdu, now)
                        told += records_in(pdu, 220) if one is link else []
                one.handle_timers(now)
        kinds = [type(each) for each in told]
        assert kinds.count(Beacon) >= 2
        assert kinds.count(Clock) >= 5
        assert kinds.count(Receipt) == 1
        assert tx(link).queued == 1
        assert link.audit() == far.audit() == []


@pytest.mark.slow
@law(40)
@given(st.integers(0, 2**32), st.sampled_from([NEVER, 0.05]))
def test_whatever_waits_goes_with_the_rest_or_at_the_end(seed, flush_s):
    """Nothing is stuck: a queued message leaves at the latest when the node stops."""
    rng = Random(seed)
    link = make_link(pdu_size=220, flush_s=flush_s, seed=seed)
    now = 0.0
    for _ in range(60):
        now += rng.random() * 0.1
        link.submit(
            rng.randrange(3), bytes(rng.randrange(4, 500)), now,
            Overrides(rng.choice((None, *Qos)), dst=rng.choice((None, 2, 3))),
        )  # fmt: skip
        if burst := compose(link, now):
            link.confirm(burst, Outcome.SENT, now)
        wakes_at = link.next_wakeup(now)
        ledger = tx(link)
        if link.has_work:
            # Sleeping forever means: no message is begun, and none would fill a PDU.
            pending = ledger.queued_bytes + (ledger.queued - 1) * ENTRY_HEADER_SIZE
            assert wakes_at < INFINITE or (
                flush_s == NEVER and not ledger.in_flight and pending < equal_payload(220, 1)
            ), f"seed {seed}"
        link.handle_timers(now)
    link.drain()
    send_all(link, now)
    assert not link.has_work
    assert link.audit() == []


TO_THE_END = "waits until it is full, however long that takes"
EXEMPT = "; urgent, latency and messages with a lifespan do not wait"


@pytest.mark.parametrize(
    ("flush_s", "told"),
    [
        ("now", '"now": a partly filled PDU is sent as soon as the radio is free'),
        (
            0.0,
            f"0.0: a partly filled PDU {TO_THE_END} (the paper's 0.0){EXEMPT}",
        ),
        (0.2, f"0.2: a partly filled PDU waits for more, up to 0.2 s{EXEMPT}"),
    ],
)
def test_what_the_setting_means_in_words(flush_s, told):
    assert flush_told(flush_s) == f"link.flush_s = {told}"


def test_what_waits_behind_the_rest_of_an_expired_command_goes_when_that_is_dropped():
    """The one with a lifespan does not wait, and takes the waiting ones along."""
    link = make_link(pdu_size=256, flush_s=0.0)
    command = TopicPolicy(lifespan_s=0.5, deadman_s=1.0)
    link.set_policies({0: command, 1: TopicPolicy(qos="bulk")})
    link.submit(0, bytes(600), 0.0)
    link.confirm(compose(link, 0.1, 2), Outcome.SENT, 0.1)
    link.submit(1, bytes(28), 0.2)
    burst = compose(link, 0.6)
    assert [message.topic_id for (message,) in burst.carried] == [1]
    assert topic_of(link, 0).dropped == {"tx_expired": 1}
