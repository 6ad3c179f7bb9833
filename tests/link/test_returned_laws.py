"""Laws that hold however many bursts are late."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import Outcome, TopicPolicy
from sdrlinkd.wire import parse
from tests.laws import law
from tests.link.books import assert_books_balance
from tests.link.world import make_link, next_burst, rx, tx

SIZE = 64


@law(25)
@given(st.integers(0, 2**32))
def test_the_ledger_adds_up_at_every_step_of_any_run(seed):
    rng = Random(seed)
    link = make_link(pdu_size=SIZE, seed=seed, beacon_s=rng.choice((0.0, 0.1)))
    link.set_policies({0: TopicPolicy(depth=rng.randrange(4)), 1: TopicPolicy(lifespan_s=0.2)})
    late, now, n_late = rng.random(), 0.0, 0
    on_air = []
    for _ in range(150):
        now += rng.random() * 0.02
        action = rng.random()
        if action < 0.4:
            link.submit(rng.randrange(3), bytes(rng.randrange(4, 400)), now)
        elif action < 0.7:
            if burst := next_burst(link, now):
                on_air.append(burst)
        elif action < 0.95 and on_air:
            outcome = rng.choice((Outcome.SENT, Outcome.LOST, Outcome.UNDERFLOW))
            outcome = Outcome.LATE if rng.random() < late else outcome
            n_late += outcome is Outcome.LATE
            link.confirm(on_air.pop(rng.randrange(len(on_air))), outcome, now)
        else:
            link.handle_timers(now)
        assert_books_balance(link, seed)
    assert link.report(0.0).bursts_late == n_late
    link.shut_down()
    for burst in on_air:
        link.confirm(burst, rng.choice((Outcome.SENT, Outcome.LATE)), now)
    assert_books_balance(link, seed)
    assert tx(link).queued == tx(link).in_flight == 0


@law(12)
@given(st.integers(0, 2**32))
def test_every_message_arrives_once_and_in_order_however_many_come_late(seed):
    rng = Random(seed)
    link, receiver = (make_link(i, pdu_size=SIZE, seed=seed, beacon_s=0.3) for i in (1, 2))
    sent, got, now = [], [], 0.0
    for i in range(150):
        now += 0.01
        payload = i.to_bytes(4, "big") + bytes(rng.randrange(150))
        link.submit(0, payload, now)
        sent.append((payload, now))
        while burst := next_burst(link, now):
            if rng.random() < 0.4:
                link.confirm(burst, Outcome.LATE, now)
                break
            link.confirm(burst, Outcome.SENT, now)
            for pdu in burst.pdus:
                for message in receiver.hear(pdu, now):
                    assert receiver.delivered(message, now) is not None
                    got.append((message.payload, message.origin_at))
    assert link.audit() == receiver.audit() == []
    assert [payload for payload, _ in got] == [payload for payload, _ in sent][: len(got)]
    assert len(got) > 120, f"seed {seed}"
    for (_, origin_at), (_, submitted_at) in zip(got, sent, strict=False):
        assert origin_at == pytest.approx(submitted_at, abs=2e-5), f"seed {seed}"
    assert rx(receiver).pdus_dropped["rx_dup"] == 0


@pytest.mark.parametrize("seed", range(3))
def test_entry_ids_rest_from_when_the_last_fragment_left(seed):
    """Not from when it was first meant to leave (wire document, section 4.2)."""
    rng = Random(seed)
    link = make_link(pdu_size=SIZE, seed=seed)
    last_left, now, n_reused = {}, 0.0, 0
    for _ in range(1000):
        now += 0.002
        for _ in range(3):
            link.submit(0, bytes(70), now)
        burst = next_burst(link, now)
        if burst is None:
            continue
        if rng.random() < 0.01:
            link.confirm(burst, Outcome.LATE, now)
            now += rng.uniform(0.5, 1.5)
            burst = next_burst(link, now)
        link.confirm(burst, Outcome.SENT, now)
        for e in (e for pdu in burst.pdus for e in parse(pdu, SIZE).entries if e.topic_id != 15):
            if e.index == 0 and e.entry_id in last_left:
                n_reused += 1
                assert now - last_left[e.entry_id] >= 0.625 - 1e-9, f"seed {seed}"
            last_left[e.entry_id] = now
    assert n_reused > 300
