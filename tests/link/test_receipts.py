"""Receipts and deliveries agree, whatever the air does; nothing expired is handed over."""

from collections import Counter
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
    QueueParams,
    RelayParams,
    TopicPolicy,
)
from sdrlinkd.link.packing import PiggybackRecords
from sdrlinkd.link.queue import Outgoing, TxTally
from sdrlinkd.link.receipts import Receipts
from sdrlinkd.link.transmit import MOST_RECEIPTS
from sdrlinkd.wire import PduBuilder, Receipt, build_records, parse
from tests.laws import law
from tests.link.steps import Steps
from tests.link.world import compose, make_link, next_burst, received, records_in, tell

STEP_S = 0.01
AIR_S = 0.001
RECEIPT_S = 2.0
N = 60


class Air(Steps):
    """Robots that hear each other at random; PDUs may be lost, duplicated and reordered."""

    def __init__(self, seed, robots, loss=0.0, doubled=0.0, late=0.0, **params):
        self.rng = Random(seed)
        self.loss, self.doubled, self.late = loss, doubled, late
        links = {
            robot: make_link(
                own_id=robot, seed=100 * seed + robot, receipt_s=RECEIPT_S, beacon_s=1.0,
                clock=ClockParams(), **params,
            )
            for robot in robots
        }  # fmt: skip
        super().__init__(links, STEP_S, next_burst)
        self.delivered = Counter()
        """Number of times that (robot, payload) was handed over."""
        self.expired = []
        self.verdicts = []

    def arrivals(self, to, src, burst):
        for pdu in burst.pdus:
            if self.rng.random() < self.loss:
                continue
            for _ in range(1 + (self.rng.random() < self.doubled)):
                delay_s = AIR_S + (self.rng.random() < self.late) * self.rng.uniform(0, 0.3)
                yield delay_s, 20.0, pdu

    def confirmed_s(self):
        return AIR_S

    def order(self, due):
        self.rng.shuffle(due)
        return due

    def take(self, robot, message):
        self.delivered[robot, message.payload] += 1
        link = self.links[robot]
        age_s = link.delivered(message, self.now)
        lifespan_s = link.policy(message.topic_id).own_lifespan_s
        if age_s is None or age_s > lifespan_s + 1e-5:
            self.expired.append((robot, age_s))

    def step(self):
        super().step()
        for robot, link in self.links.items():
            self.verdicts += [(robot, each) for each in link.take_verdicts()]


def message(number, size=40):
    return b"\0\1\0\0" + number.to_bytes(4, "little") + bytes(size)


@pytest.mark.slow
@law(25)
@given(
    st.integers(0, 1000), st.floats(0, 0.6), st.floats(0, 0.5), st.floats(0, 0.5),
    st.sampled_from([20, 150]), st.sampled_from([None, 0.05]),
)  # fmt: skip
def test_receipts_and_deliveries_agree(seed, loss, doubled, late, size, lifespan_s):
    air = Air(seed, (1, 2, 3), loss, doubled, late, pdu_size=128)
    policy = TopicPolicy(lifespan_s=lifespan_s or float("inf"))
    for link in air.links.values():
        link.set_policy(0, policy)
    air.run(1.5)
    sent = {}
    for number in range(N):
        sent[f"m{number}"] = (payload := message(number, size)), 2 if number % 2 else 255
        overrides = Overrides(dst=sent[f"m{number}"][1], receipt=f"m{number}")
        air.links[1].submit(0, payload, air.now, overrides)
        air.run(air.now + 0.03)
    air.run(air.now + RECEIPT_S + 0.5)
    told = {(verdict.receipt, verdict.dst): verdict for _, verdict in air.verdicts}
    assert len(told) == len(air.verdicts), "each robot is told of once"
    assert all(robot == 1 for robot, _ in air.verdicts)
    left = {}
    for _, verdict in air.verdicts:
        left.setdefault(verdict.receipt, []).append(verdict.left)
    assert all(each == list(range(len(each)))[::-1] for each in left.values()), "it counts down"
    assert air.expired == []
    assert max(air.delivered.values(), default=1) == 1
    for name, (payload, dst) in sent.items():
        mine = {at: verdict for (receipt, at), verdict in told.items() if receipt == name}
        assert mine, name
        for robot, verdict in mine.items():
            got = air.delivered[robot, payload]
            if verdict.fate == "delivered":
                assert got == 1, (name, verdict)
                assert 0 < verdict.took_s < 3.0
            elif verdict.fate in ("expired", "dropped"):
                assert got == 0, (name, verdict)
            assert dst in (255, robot) or robot == 255
    if loss == 0 and lifespan_s is None:
        assert all(each.fate == "delivered" for each in told.values())
        assert len(told) == N // 2 * 3


def test_what_never_left_is_told_of_at_once():
    link = make_link(queue=None)
    link.set_policy(0, TopicPolicy(depth=1, max_bytes=100, lifespan_s=0.5))
    link.submit(0, message(1), 0.0, Overrides(receipt="one"))
    link.submit(0, message(2), 0.0, Overrides(receipt="two"))
    link.submit(0, message(3, 200), 0.0, Overrides(receipt="three"))
    link.handle_timers(1.0)
    link.refuse("tx_bad_envelope", 0, "four")
    verdicts = link.take_verdicts()
    assert [(each.receipt, each.fate, each.reason) for each in verdicts] == [
        ("one", "dropped", "tx_superseded"),
        ("three", "dropped", "tx_size_cap"),
        ("two", "expired", "tx_expired"),
        ("four", "dropped", "tx_bad_envelope"),
    ]


def test_nobody_there_is_an_answer_too():
    link = make_link(receipt_s=1.0)
    link.submit(0, message(1), 0.0, Overrides(receipt="one"))
    burst = next_burst(link, 0.0)
    link.confirm(burst, Outcome.SENT, 0.001)
    link.handle_timers(0.9)
    assert link.take_verdicts() == []
    link.handle_timers(1.1)
    (verdict,) = link.take_verdicts()
    assert (verdict.fate, verdict.dst) == ("unknown", 255)


def test_a_burst_that_the_radio_lost_is_no_delivery():
    link = make_link()
    link.submit(0, message(1), 0.0, Overrides(receipt="one", dst=2))
    link.confirm(next_burst(link, 0.0), Outcome.LOST, 0.001)
    (verdict,) = link.take_verdicts()
    assert (verdict.fate, verdict.reason, verdict.dst) == ("dropped", "tx_radio_failed", 2)
    link.handle_timers(100.0)
    assert link.take_verdicts() == []


def test_of_all_robots_asked_the_last_one_is_told_of_as_such():
    link = make_link()
    for robot in (2, 3):
        tell(link, robot, at=0.0)
    link.submit(0, message(1), 0.0, Overrides(receipt="one"))
    link.confirm(next_burst(link, 0.0), Outcome.LOST, 0.001)
    link.submit(0, message(2), 1.0, Overrides(receipt="two"))
    link.confirm(next_burst(link, 1.0), Outcome.SENT, 1.001)
    link.handle_timers(10.0)
    told = [(each.receipt, each.dst, each.left) for each in link.take_verdicts()]
    assert told == [("one", 2, 1), ("one", 3, 0), ("two", 2, 1), ("two", 3, 0)]


@pytest.mark.slow
def test_a_receipt_is_for_the_message_that_had_the_entry_id_then():
    """Entry ids are reused after 256 messages."""
    air = Air(5, (1, 2), pdu_size=128)
    air.run(1.5)
    for number in range(600):
        air.links[1].submit(0, message(number), air.now, Overrides(dst=2, receipt=f"m{number}"))
        air.run(air.now + 2 * STEP_S)
    air.run(air.now + RECEIPT_S + 0.5)
    assert Counter(each.fate for _, each in air.verdicts) == {"delivered": 600}
    assert air.links[1].report(air.now).receipts_unasked == 0


def test_receipts_that_reach_nobody_are_reported():
    sender, link = make_link(2), make_link(1)
    for number in range(300):
        sender.submit(number % 2, message(number), 0.9, Overrides(receipt="one"))
    while burst := compose(sender, 1.0):
        for pdu in burst.pdus:
            link.hear(pdu, 1.0)
    tell(link, 2, Receipt(0, 5, 1, 1), at=1.0)
    report = link.report(1.0)
    assert (report.receipts_untold, report.receipts_unasked) == (300 - MOST_RECEIPTS, 1)


def test_a_receipt_that_waited_is_for_the_message_of_then():
    """It states its time; the entry id belongs to another message by now."""
    receipts = Receipts(1, RECEIPT_S)
    for name, at in (("then", 10.0), ("now", 10.5)):
        asks = Outgoing(
            0, b"", Qos.DEFAULT, 0, 2, at, 99.0, wants_stamp=True, tally=TxTally(), receipt=name
        )
        asks.cut(7, 10, 1, at)
        receipts.expect(asks, (), at)
    piggyback, draft = PiggybackRecords(), PduBuilder(128)
    piggyback.put_receipt(Receipt(0, 7, 1, 1, 100), 0.0, 10.01)
    piggyback.ride(draft, 10.6, 0)
    (told,) = records_in(draft.build(0, 1, 255, 0, 1), 128)
    assert told == Receipt(0, 7, 1, 1, 100, 5900)
    receipts.hear(2, told, 10.6)
    (verdict,) = receipts.take()
    assert (verdict.receipt, verdict.took_s) == ("then", pytest.approx(0.01))
    receipts.hear(2, told._replace(since_100us=0), 10.6)
    assert receipts.take()[0].receipt == "now"


def test_a_receipt_of_the_short_form_is_for_whom_the_pdu_is():
    """A RECEIPT without node and age, as originally specified."""
    link = make_link()
    link.submit(0, message(1), 0.0, Overrides(receipt="one", dst=2))
    burst = next_burst(link, 0.0)
    link.confirm(burst, Outcome.SENT, 0.001)
    ((asks,),) = burst.carried
    answer = build_records([Receipt(0, asks.entry_id, 1)])
    builder = PduBuilder(link.params.pdu_size)
    assert builder.add_record(answer)
    link.hear(builder.build(0, 2, link.own_id, 0, 1), 0.1)
    (verdict,) = link.take_verdicts()
    assert (verdict.fate, verdict.took_s) == ("delivered", None)


@pytest.mark.parametrize("lifespan_s", [0.05, float("inf")])
def test_a_message_of_unknown_age_is_refused_where_age_matters(lifespan_s):
    sender, receiver = make_link(own_id=1), make_link(own_id=2)
    sender.set_policy(0, TopicPolicy(stamp=False))
    receiver.set_policy(0, TopicPolicy(lifespan_s=lifespan_s))
    sender.submit(0, message(1), 0.0)
    got = []
    for pdu in compose(sender, 0.0).pdus:
        got += receiver.hear(pdu, 0.0, None, 0.01)
    assert len(got) == (lifespan_s == float("inf"))
    assert received(receiver)[1, 0].dropped["rx_no_age"] == (lifespan_s < 1)
    receiver.set_policy(0, TopicPolicy(lifespan_s=lifespan_s, stamp=False))
    sender.submit(0, message(2), 0.1)
    for pdu in compose(sender, 0.1).pdus:
        assert receiver.hear(pdu, 0.1, None, 0.11), "one's own decision"


def test_a_relay_sends_on_nothing_that_is_too_old():
    sender = make_link(own_id=1, hop_limit=2)
    relay = make_link(own_id=2, hop_limit=2, relay=RelayParams(policy="flood"))
    relay.set_policy(0, TopicPolicy(lifespan_s=0.2))
    for number in range(2):
        sender.submit(0, message(number), 0.0)
        for pdu in compose(sender, 0.05).pdus:
            relay.hear(pdu, 0.05, None, 0.05)
        if number == 0:
            assert compose(relay, 0.19).pdus
    compose(relay, 0.21)
    assert relay.report(0.0).relayed.dropped == {"tx_expired": 1}


def test_a_command_topic_that_falls_silent_is_due_once():
    air = Air(7, (1, 2))
    air.links[2].set_policy(0, TopicPolicy(deadman_s=0.3))
    link = air.links[2]
    for number in range(5):
        air.links[1].submit(0, message(number), air.now)
        air.run(air.now + 0.1)
        assert link.take_silent(air.now) == []
    assert link.silence_at == pytest.approx(air.now + 0.2, abs=0.03)
    air.run(air.now + 0.3)
    assert link.take_silent(air.now) == [(1, 0)]
    air.run(air.now + 1.0)
    assert link.take_silent(air.now) == []
    air.links[1].submit(0, message(9), air.now)
    air.run(air.now + 0.1)
    air.links[2].set_policy(0, TopicPolicy())
    air.run(air.now + 1.0)
    assert link.take_silent(air.now) == [], "the policy has changed"
    assert received(link)[1, 0].stops == 1


def test_the_yardstick_sees_a_receipt_that_lies():
    air = Air(1, (1, 2))
    air.links[2].set_policy(0, TopicPolicy(max_bytes=1))
    air.run(1.5)
    air.links[1].submit(0, message(1), air.now, Overrides(receipt="one", dst=2))
    air.run(air.now + 1.0)
    ((_, verdict),) = air.verdicts
    assert (verdict.fate, verdict.reason) == ("dropped", "rx_size_cap")
    assert not air.delivered


def test_a_relay_that_has_just_begun_sends_on_nothing_that_is_too_old_either():
    sender = make_link(own_id=1, hop_limit=2)
    relay = make_link(own_id=2, hop_limit=2, relay=RelayParams(policy="flood"))
    relay.set_policy(0, TopicPolicy(lifespan_s=0.2))
    sender.submit(0, message(1), 5.0)
    for pdu in compose(sender, 9.0).pdus:
        relay.hear(pdu, 0.5, None, 0.5)
    compose(relay, 0.6)
    assert relay.report(0.0).relayed.dropped == {"tx_expired": 1}


@pytest.mark.parametrize("answered", [True, False])
def test_a_message_is_told_of_once_however_late_it_fails(answered):
    link = make_link(receipt_s=1.0)
    link.submit(0, message(1), 0.0, Overrides(receipt="one", dst=2))
    burst = next_burst(link, 0.0)
    ((asks,),) = burst.carried
    if answered:
        tell(link, 2, Receipt(0, asks.entry_id, 1, link.own_id), at=0.1)
    else:
        link.handle_timers(2.0)
    link.confirm(burst, Outcome.LOST, 2.1)
    link.handle_timers(10.0)
    (verdict,) = link.take_verdicts()
    assert verdict.fate == ("delivered" if answered else "unknown")


def test_without_a_control_channel_nobody_can_know():
    link = make_link(topics=[(f"t{i}", "std_msgs/String") for i in range(16)])
    assert link.submit(0, message(1), 0.0, Overrides(receipt="one", dst=3)) is None
    (verdict,) = link.take_verdicts()
    assert (verdict.fate, verdict.dst) == ("unknown", 3)


def test_without_a_control_channel_everything_is_told_once():
    queue = QueueParams(max_bytes=100)
    link = make_link(topics=[(f"t{i}", "std_msgs/String") for i in range(16)], queue=queue)
    link.set_policy(0, TopicPolicy(depth=1, lifespan_s=0.5))
    link.submit(0, message(1), 0.0, Overrides(receipt="superseded"))
    link.submit(0, message(2), 0.0, Overrides(receipt="expired"))
    link.submit(0, message(3, 200), 0.0, Overrides(receipt="too large"))
    link.handle_timers(1.0)
    link.submit(0, message(4), 1.0, Overrides(receipt="lost"))
    link.confirm(next_burst(link, 1.0), Outcome.LOST, 1.001)
    link.handle_timers(100.0)
    told = [(each.receipt, each.fate, each.reason) for each in link.take_verdicts()]
    assert told == [
        ("superseded", "unknown", ""),
        ("expired", "unknown", ""),
        ("too large", "dropped", "tx_overflow_new"),
        ("lost", "unknown", ""),
    ]


def test_what_is_refused_names_the_robot_it_was_for():
    link = make_link()
    link.set_policy(0, TopicPolicy(max_bytes=10))
    link.submit(0, message(1), 0.0, Overrides(receipt="one", dst=3))
    assert link.take_verdicts()[0].dst == 3


def test_an_early_stamp_is_kept_while_its_message_is_still_arriving():
    sender, receiver = make_link(own_id=1, pdu_size=64), make_link(own_id=2, pdu_size=64)
    receiver.set_policy(0, TopicPolicy(lifespan_s=60.0))
    sender.submit(0, message(1, 900), 0.0)
    pdus = []
    for i in range(40):
        if i == 2:
            # The rest of the message leaves room for the other's age, too.
            sender.submit(1, message(2, 4), 0.0)
        burst = compose(sender, 0.05 * i, 1)
        pdus += [(0.05 * i, pdu) for pdu in (burst.pdus if burst else ())]
    got = []
    for at, pdu in pdus:
        receiver.handle_timers(at)
        got += receiver.hear(pdu, at, None, at)
    assert len(got) == 2
    assert received(receiver)[1, 0].dropped == {}


def test_what_parity_repairs_has_its_age():
    classes = ClassesParams(default=ClassParams(parity=0.3))
    sender, receiver = (
        make_link(own_id=1, pdu_size=128, classes=classes),
        make_link(own_id=2, pdu_size=128),
    )
    receiver.set_policy(0, TopicPolicy(lifespan_s=60.0))
    sender.submit(0, message(1, 1200), 0.0)
    pdus = []
    while burst := compose(sender, 0.1):
        pdus += burst.pdus
    last = max(
        i for i, pdu in enumerate(pdus) if any(e.topic_id == 0 for e in parse(pdu, 128).entries)
    )
    got = []
    for i, pdu in enumerate(pdus):
        if i != last:
            got += receiver.hear(pdu, 0.1, None, 0.11)
    (heard,) = got
    assert heard.origin_at == pytest.approx(0.0, abs=1e-5)
    assert receiver.report(0.0).fragments_repaired >= 1


def test_a_message_dropped_while_a_burst_is_composed_is_told_of_with_it():
    link = make_link()
    link.submit(0, message(1), 0.0, Overrides(receipt="old", dst=2, lifespan_s=0.1))
    link.submit(0, message(2), 0.0, Overrides(receipt="new", dst=2))
    assert next_burst(link, 0.2) is not None
    (verdict,) = link.take_verdicts()
    assert (verdict.receipt, verdict.fate) == ("old", "expired")
