"""For any packing: no burst is too long, none mixes sources, and the queue stays in order."""

from math import inf
from random import Random

from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import (
    Allowance,
    ClassesParams,
    ClassParams,
    LinkParams,
    Outbox,
    Overrides,
    Qos,
    QueueParams,
)
from sdrlinkd.link.packing import Composer, PiggybackRecords
from sdrlinkd.link.queue import Fate, Intake
from sdrlinkd.link.topics import OwnTopics
from sdrlinkd.wire import make_registry, parse
from tests.laws import law
from tests.link.world import TOPICS, compose, make_link

PDU_SIZE = 220
CLASSES = ClassesParams(bulk=ClassParams(parity=0.3, share=0.1))


def walk(outbox):
    """(messages waiting, messages being fragmented), counted over every lane."""
    waiting, current = [], []
    for level in outbox.levels:
        assert level.lanes, "an empty level stays behind"
        for lane in level.lanes:
            waiting += lane.waiting
            current += [lane.current] if lane.current else []
    return waiting, current


@law(40)
@given(st.integers(0, 2**32))
def test_bursts_are_as_long_as_allowed_and_of_one_source(seed):
    rng = Random(seed)
    registry = make_registry(TOPICS)
    outbox = Outbox(QueueParams(max_messages=rng.randrange(1, 40)), 64)
    params = LinkParams(pdu_size=PDU_SIZE, greedy=rng.random() < 0.5)
    intake = Intake(params, OwnTopics(registry, False, 100), outbox, CLASSES, {})
    composer = Composer(params, 1, outbox, PiggybackRecords(), rng, 0.5, True, CLASSES)
    stranger = make_link(9, pdu_size=PDU_SIZE, seed=seed, hop_limit=2)
    bursts, now = [], 0.0
    for _ in range(150):
        now += rng.random() * 0.02
        action = rng.random()
        if action < 0.1:
            stranger.submit(rng.randrange(3), bytes(rng.randrange(4, 200)), now)
            for data in compose(stranger, now).pdus:
                pdu = parse(data, PDU_SIZE)
                intake.forward(pdu, data, now, now + rng.choice((0.01, 1.0)), None, inf)
        elif action < 0.5:
            wishes = Overrides(rng.choice((None, *Qos)), dst=rng.choice((None, 2)))
            intake.submit(rng.randrange(3), bytes(rng.randrange(4, 600)), now, wishes)
        elif action < 0.8:
            most = tuple(rng.randrange(6) for _ in Qos)
            owed = tuple(rng.choices(list(Qos), k=rng.choice((0, 0, 1, 3, 8))))
            source = rng.choice((None, None, 1))
            built = composer.fill(now, Allowance(most, owed), source)
            assert len(built) <= max(1, *most), f"seed {seed}"
            assert len({pdu.src for pdu in built} | {source or pdu.src for pdu in built}) <= 1
            bursts.append([pdu.carried for pdu in built])
        elif action < 0.95 and bursts:
            carried = bursts.pop(rng.randrange(len(bursts)))
            if rng.random() < 0.8:
                outbox.lives.left(carried)
            else:
                for message in outbox.lives.failed(carried, "tx_radio_failed"):
                    composer.abandon(message.lane, now)
        else:
            composer.expire(now)
        waiting, current = walk(outbox)
        assert intake.audit() == [], f"seed {seed}"
        assert outbox.queued == len(waiting) == sum(outbox.queued_by_class().values())
        assert outbox.queued_bytes == sum(len(message.payload) for message in waiting)
        assert set(current) <= outbox.lives.in_flight
        assert all(message.fate is Fate.IN_FLIGHT for message in outbox.lives.in_flight)
