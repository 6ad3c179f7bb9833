"""Laws for any traffic: the ledger adds up, order is kept, no message is invented."""

from collections import Counter
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.config import DirectParams
from sdrlinkd.link import (
    ClassesParams,
    ClassParams,
    Outcome,
    Overrides,
    Qos,
    QueueParams,
    ReassemblyParams,
    RelayParams,
    TopicPolicy,
)
from sdrlinkd.pdulink import Impairment
from tests.laws import law
from tests.link.books import assert_books_balance
from tests.link.world import compose, make_link, rx, send_all, tx


def any_policy(rng):
    return TopicPolicy(
        depth=rng.choice((0, 0, 1, 3)),
        weight=rng.choice((0.1, 1.0, 1.0, 7.0)),
        lifespan_s=rng.choice((0.2, 1e9)),
        period_s=rng.choice((0.0, 0.0, 0.03)),
        decimate=rng.choice((1, 1, 2)),
        on_change=rng.random() < 0.2,
        max_bytes=rng.choice((0, 0, 400)),
        compress=rng.choice(("none", "zstd")),
        durability=rng.choice(("volatile", "transient_local")),
        queue_bytes=rng.choice((0, 0, 900)),
    )


@pytest.mark.slow
@law(40)
@given(st.integers(0, 2**32))
def test_the_ledger_holds_at_every_step_of_any_run(seed):
    rng = Random(seed)
    pdu_size = rng.choice((32, 64, 220, 1024))
    link = make_link(
        pdu_size=pdu_size,
        seed=seed,
        queue=QueueParams(max_messages=rng.randrange(1, 40), max_bytes=rng.randrange(500, 20_000)),
        greedy=rng.random() < 0.5,
        flush_s=rng.choice(("now", "now", 0.05, 0.0)),
        beacon_s=rng.choice((0.0, 0.1)),
        hears_self=True,
        classes=ClassesParams(bulk=ClassParams(parity=rng.choice((0.0, 0.3)), share=0.1)),
        relay=RelayParams(policy=rng.choice(("none", "flood"))),
        hop_limit=2,
    )
    link.set_policies({i: any_policy(rng) for i in range(3)})
    stranger = make_link(9, pdu_size=pdu_size, seed=seed + 1, hop_limit=2)
    bursts, now = [], 0.0
    for _ in range(200):
        now += rng.random() * 0.02
        action = rng.random()
        if action < 0.05:
            stranger.submit(rng.randrange(3), bytes(rng.randrange(4, 200)), now, Overrides(dst=7))
            for data in send_all(stranger, now):
                link.hear(data, now)
        elif action < 0.07:
            link.set_policy(rng.randrange(3), any_policy(rng))
        elif action < 0.5:
            link.submit(
                rng.randrange(3), bytes(rng.randrange(4, 600)), now,
                Overrides(
                    rng.choice((None, *Qos)), rng.choice((None, 0, 127)), rng.choice((None, 1)),
                    rng.choice((None, 0.05)),
                ),
            )  # fmt: skip
        elif action < 0.75:
            most = rng.randrange(1, 6)
            burst = compose(link, now, most)
            if burst:
                goes_again = burst.start > burst.first_start
                assert goes_again or len(burst.pdus) <= most, f"seed {seed}"
                assert len({data[1] for data in burst.pdus}) == 1, f"seed {seed}"
                bursts.append(burst)
        elif action < 0.95 and bursts:
            burst = bursts.pop(rng.randrange(len(bursts)))
            link.confirm(burst, rng.choice((Outcome.SENT, Outcome.SENT, *Outcome)), now)
            for data in burst.pdus:
                link.hear(data, now)
        else:
            link.handle_timers(now)
        assert_books_balance(link, seed)
    link.shut_down()
    for burst in bursts:
        link.confirm(burst, Outcome.SENT, now)
    assert_books_balance(link, seed)
    assert tx(link).queued == tx(link).in_flight == 0


@pytest.mark.slow
@law(30)
@given(st.integers(0, 2**32))
def test_whatever_the_air_does_nothing_is_made_up(seed):
    """Loss, duplication, bit errors, reordering: a message arrives whole, once, or not at all."""
    rng = Random(seed)
    air = Impairment(
        DirectParams(loss=0.1, duplicate=0.1, corrupt=0.05, jitter_s=0.03, delay_s=0.001), rng
    )
    pdu_size = rng.choice((64, 220, 1024))
    reassembly = ReassemblyParams(timeout_s=0.2)
    sender = make_link(1, pdu_size=pdu_size, seed=seed, reassembly=reassembly)
    receiver = make_link(2, pdu_size=pdu_size, seed=seed, reassembly=reassembly)
    sent, on_air, got = Counter(), [], Counter()
    now = 0.0
    for i in range(300):
        now += 0.005
        payload = i.to_bytes(4, "big") + rng.randbytes(rng.randrange(0, 500))
        topic = rng.randrange(3)
        sent[topic, payload] += 1
        sender.submit(topic, payload, now)
        if burst := compose(sender, now, 8):
            sender.confirm(burst, Outcome.SENT, now)
            on_air += [
                (now + delay_s, data) for pdu in burst.pdus for delay_s, data in air.arrivals(pdu)
            ]
        on_air.sort()
        while on_air and on_air[0][0] <= now:
            at, data = on_air.pop(0)
            for message in receiver.hear(data, at):
                got[message.topic_id, message.payload] += 1
        receiver.handle_timers(now)
        assert receiver.audit() == [], f"seed {seed}"
    receiver.handle_timers(now + 1)
    assert rx(receiver).held == 0
    assert got.keys() <= sent.keys(), f"seed {seed}: a message nobody sent"
    assert max(got.values()) == 1, f"seed {seed}: delivered twice"
    assert len(got) > 60, f"seed {seed}: positive control"


@pytest.mark.slow
@law(30)
@given(st.integers(0, 2**32))
def test_order_holds_within_a_topic(seed):
    rng = Random(seed)
    sender = make_link(1, pdu_size=64, seed=seed)
    receiver = make_link(2, pdu_size=64, seed=seed)
    got, now = [], 0.0
    for i in range(150):
        now += 0.01
        sender.submit(i % 3, i.to_bytes(4, "big") + bytes(rng.randrange(200)), now)
        if burst := compose(sender, now, rng.randrange(1, 5)):
            sender.confirm(burst, Outcome.SENT, now)
            for data in burst.pdus:
                if rng.random() < 0.95:
                    got += receiver.hear(data, now)
    for topic in range(3):
        numbers = [m.payload[:4] for m in got if m.topic_id == topic]
        assert numbers == sorted(numbers), f"seed {seed}"


@pytest.mark.parametrize("topics", [1, 3])
def test_entry_ids_are_not_used_again_before_their_rest(topics):
    link = make_link(pdu_size=64, seed=9)
    used = {}
    now = 0.0
    from sdrlinkd.wire import parse

    for i in range(1500):
        now += 0.002
        link.submit(i % topics, bytes(120), now)
        if burst := compose(link, now, 8):
            link.confirm(burst, Outcome.SENT, now)
            for data in burst.pdus:
                for e in parse(data, 64).entries:
                    if e.topic_id != 15:
                        last_total_at = used.get((e.topic_id, e.entry_id))
                        if e.index == 0:
                            assert last_total_at is None or now - last_total_at >= 0.625 - 1e-9
                        used[e.topic_id, e.entry_id] = now
