"""Messages too large for 255 fragments: sent in parts with parity, and joined again."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.link import ClassesParams, DefaultParams, Outcome, Overrides, ReassemblyParams
from sdrlinkd.wire import Entry, Pdu, build, max_large_size, parse
from tests.laws import law
from tests.link.world import compose, make_link, received, rx, tx

SEED = 21


def pair(pdu_size=64, **more):
    """A sender and a receiver of large messages."""
    return (
        make_link(1, pdu_size=pdu_size, has_numbers=True, **more),
        make_link(2, pdu_size=pdu_size, has_numbers=True, seed=2, **more),
    )


def bursts(link, most=63, now=0.0):
    """The PDUs of all that `link` has to send, burst by burst, each confirmed as sent."""
    while (burst := compose(link, now, most)) is not None:
        link.confirm(burst, Outcome.SENT, now)
        yield burst.pdus


def pdus_of(link, most=63):
    return [pdu for pdus in bursts(link, most) for pdu in pdus]


def hear(link, pdus, at=0.0):
    return [message for pdu in pdus for message in link.hear(pdu, at)]


def image(size, seed=SEED):
    return b"\0\1\0\0" + Random(seed).randbytes(size - 4)


@pytest.mark.slow
@law(30)
@given(
    size=st.integers(12_000, 120_000), pdu_size=st.sampled_from((64, 100, 220)),
    seed=st.integers(0, 2**32), most=st.integers(1, 63), order=st.booleans(),
)  # fmt: skip
def test_any_message_arrives_in_any_order_of_its_pdus(size, pdu_size, seed, most, order):
    sender, receiver = pair(pdu_size)
    sender.submit(0, image(size, seed), 0.0)
    pdus = pdus_of(sender, most)
    if order:
        # The duplicate filter takes PDUs that are up to 127 behind.
        rng = Random(seed)
        for begin in range(0, len(pdus), 60):
            some = pdus[begin : begin + 60]
            pdus[begin : begin + 60] = rng.sample(some, len(some))
    got = hear(receiver, pdus)
    assert [each.payload for each in got] == [image(size, seed)]
    assert (got[0].topic_id, got[0].number) == (0, 1)
    assert sender.audit() == receiver.audit() == []
    receiver.handle_timers(5.0)  # late fragments of a part that parity had completed
    assert (rx(receiver).started, rx(receiver).delivered, rx(receiver).held_bytes) == (1, 1, 0)
    assert (tx(sender).accepted, tx(sender).sent) == (1, 1)


@pytest.mark.parametrize(("share", "lost"), [(0.0, 0.05), (0.3, 0.15)])
def test_parity_repairs_what_is_lost_in_each_part(share, lost):
    """A tenth of parity is the default for parts; a class may ask for more."""
    classes = ClassesParams(default=DefaultParams(parity=share))
    sender, receiver = pair(1024, classes=classes)
    rng = Random(SEED)
    payload = image(1_000_000)
    sender.submit(0, payload, 0.0)
    pdus = pdus_of(sender)
    assert len(pdus) >= (1 + max(share, 0.1)) * len(payload) / 1011
    assert [m.payload for m in hear(receiver, (p for p in pdus if rng.random() > lost))] == [
        payload
    ]
    assert receiver.report(0.0).fragments_repaired > 30


def test_with_a_part_lost_for_good_the_message_is_dropped_by_name():
    sender, receiver = pair()
    sender.submit(0, image(40_000), 0.0)
    pdus = pdus_of(sender)
    assert hear(receiver, pdus[300:]) == []
    assert rx(receiver).held == 1
    receiver.handle_timers(0.4)
    assert rx(receiver).held == 1
    receiver.handle_timers(0.6)
    receiver.handle_timers(1.2)
    assert received(receiver)[1, 0].dropped == {"rx_part_lost": 1}
    assert (rx(receiver).held, rx(receiver).held_bytes) == (0, 0)
    assert receiver.audit() == []


def test_its_age_and_its_receipt():
    sender, receiver = pair()
    sender.submit(0, image(40_000), 0.0, Overrides(dst=2, receipt="a.1"))
    got, now = [], 0.0
    while (burst := compose(sender, now, 20)) is not None:
        sender.confirm(burst, Outcome.SENT, now)
        got += hear(receiver, burst.pdus, now)
        now += 0.02
    (message,) = got
    assert message.origin_at == pytest.approx(0.0, abs=1e-5)
    assert message.began_at == 0.0
    back = compose(receiver, now + 0.1, 1)
    hear(sender, back.pdus, now + 0.1)
    (verdict,) = sender.take_verdicts()
    assert (verdict.receipt, verdict.topic_id, verdict.dst, verdict.fate) == (
        "a.1",
        0,
        2,
        "delivered",
    )
    assert verdict.took_s == pytest.approx(message.heard_at, abs=0.03)


def test_a_receipt_tells_that_the_last_part_was_lost():
    sender, receiver = pair()
    sender.submit(0, image(40_000), 0.0, Overrides(dst=2, receipt="a.1"))
    pdus = pdus_of(sender)
    firsts = [parse(pdu, 64).entries[0] for pdu in pdus]
    of_last = max(i for i, entry in enumerate(firsts) if entry.topic_id == 14)
    hear(receiver, pdus[: of_last - 100] + pdus[of_last - 50 : of_last + 1])
    for now in (0.6, 1.2):
        receiver.handle_timers(now)
    hear(sender, compose(receiver, 1.3, 1).pdus, 1.3)
    assert [(each.fate, each.reason) for each in sender.take_verdicts()] == [
        ("dropped", "rx_part_lost")
    ]


def test_others_go_between_its_parts():
    sender, receiver = pair()
    sender.submit(0, image(60_000), 0.0)
    sender.submit(1, image(40_000), 0.0)
    heard = []
    for number, pdus in enumerate(bursts(sender, 8)):
        heard += hear(receiver, pdus)
        if number < 100:
            sender.submit(2, b"\0\1\0\0" + bytes([number]), 0.0, Overrides(priority=100))
    assert [m.payload[4] for m in heard if m.topic_id == 2] == list(range(100))
    assert {m.topic_id: m.payload for m in heard if m.topic_id != 2} == {
        0: image(60_000), 1: image(40_000),
    }  # fmt: skip
    assert sender.audit() == receiver.audit() == []


def test_a_burst_that_leaves_late_is_joined_all_the_same():
    """The entry ids of earlier parts are held while their fragments wait for another slot."""
    sender, receiver = pair()
    payload = image(60_000)
    sender.submit(0, payload, 0.0)
    now, got, late = 0.0, [], 0
    while (burst := compose(sender, now, 40)) is not None:
        if late % 3 == 0:
            sender.confirm(burst, Outcome.LATE, now)
        else:
            sender.confirm(burst, Outcome.SENT, now)
            got += hear(receiver, burst.pdus, now)
        late += 1
        now += 0.05
        receiver.handle_timers(now)
    assert [each.payload for each in got] == [payload]
    assert sender.audit() == receiver.audit() == []


@pytest.mark.slow
def test_the_largest_and_one_octet_more():
    sender, receiver = pair(32)
    most = max_large_size(32)
    assert sender.submit(0, bytes(most + 1), 0.0) == "tx_too_big"
    assert sender.submit(0, image(most), 0.0) is None
    assert [m.payload for m in hear(receiver, pdus_of(sender))] == [image(most)]


@pytest.mark.slow
def test_8_mib_at_1_mbit_per_s_take_a_minute_and_hold_nobody_up():
    """The other topic is of the same class, and has less than its share."""
    sender, receiver = pair(1100)
    payload, pdu_s, period_s = image(8 << 20), 1100 * 8 / 1e6, 1 / 30
    assert sender.submit(1, payload, 0.0) is None
    now, due, got, waits = 0.0, 0.0, b"", []
    while not got:
        while due <= now:
            sender.submit(0, image(724), due)
            due += period_s
        burst = compose(sender, now, 1)
        now += pdu_s
        sender.confirm(burst, Outcome.SENT, now)
        for message in hear(receiver, burst.pdus, now):
            if message.topic_id == 1:
                got = message.payload
            else:
                waits.append(now - message.origin_at)
        if len(waits) % 50 == 0:
            assert rx(receiver).held_bytes <= ReassemblyParams().source_bytes
    assert got == payload
    assert max(waits) <= 4 * pdu_s
    assert len(waits) >= now / period_s - 3
    # The parity of its parts is a tenth; the other topic takes a PDU each time.
    assert now < 1.3 * 8 * len(payload) / 1e6 / (1 - pdu_s / period_s)
    assert sender.audit() == receiver.audit() == []


def test_without_numbers_it_is_refused_and_its_parts_are_of_an_unknown_topic():
    sender, _ = pair()
    plain = make_link(2, pdu_size=64)
    assert plain.submit(0, image(13_006), 0.0) == "tx_too_big"
    sender.submit(0, image(20_000), 0.0)
    sender.submit(1, image(40), 0.0)
    assert [m.topic_id for m in hear(plain, pdus_of(sender))] == [1]
    assert plain.audit() == []
    assert set(rx(plain).dropped) <= {"rx_unknown_topic", "rx_partial_timeout"}


@pytest.mark.slow
def test_memory_holds_for_parts_too():
    limits = ReassemblyParams(source_bytes=1 << 18, total_bytes=1 << 19)
    receiver = make_link(2, pdu_size=1024, has_numbers=True, reassembly=limits)
    for src in range(3, 9):
        sender = make_link(src, pdu_size=1024, has_numbers=True, seed=src)
        sender.submit(0, image(900_000), 0.0)
        assert hear(receiver, pdus_of(sender)[:-5]) == []
        assert rx(receiver).held_bytes <= 1 << 19
        assert receiver.audit() == []
    assert set(rx(receiver).dropped) <= {"rx_partial_evicted", "rx_partial_memory", "rx_part_lost"}


@law(100)
@given(st.lists(st.tuples(st.integers(0, 3), st.binary(max_size=40)), max_size=30))
def test_any_octets_as_parts_are_dropped_or_joined(sent):
    receiver = make_link(2, pdu_size=64, has_numbers=True)
    for seq, (number, octets) in enumerate(sent):
        entry = Entry(14, seq, 0, 1, bytes([number]) + octets)
        receiver.hear(build(Pdu(0, False, 1, 255, seq, 1, [entry]), 64), 0.0)
    receiver.handle_timers(5.0)
    assert receiver.audit() == []
    assert rx(receiver).held == 0


@pytest.mark.long
def test_between_two_parts_it_ends_with_no_entry_id():
    """A message that expires there has given its id back once."""
    sender, _ = pair()
    sender.submit(0, image(60_000), 0.0, Overrides(lifespan_s=1.0))
    sizes = []
    for step in range(2000):
        now = 0.001 * step if step < 400 else 2.0
        sender.handle_timers(now)
        burst = compose(sender, now, 1)
        if burst is None:
            break
        sender.confirm(burst, Outcome.SENT, now)
    for number in range(300):
        sender.submit(1, image(14_000, number), 4.0 + 0.01 * number)
    now = 4.0
    receiver = make_link(2, pdu_size=64, has_numbers=True)
    while (burst := compose(sender, now, 63)) is not None:
        sender.confirm(burst, Outcome.SENT, now)
        sizes += [len(m.payload) for m in hear(receiver, burst.pdus, now)]
        now += 0.004
    assert sizes == [14_000] * 300
    assert sender.audit() == receiver.audit() == []


@pytest.mark.slow
def test_a_stream_of_large_messages_names_the_one_that_lost_a_part():
    sender, receiver = pair()
    got = []
    for number in range(12):
        now = 0.4 * number
        sender.submit(0, image(30_000, number), now)
        pdus = pdus_of(sender)
        lost = range(40, 400) if number == 3 else ()
        got += hear(receiver, [pdu for i, pdu in enumerate(pdus) if i not in lost], now)
        receiver.handle_timers(now + 0.3)
    receiver.handle_timers(0.4 * 12)
    assert len(got) == 11
    assert received(receiver)[1, 0].dropped == {"rx_part_lost": 1}
    assert rx(receiver).held == 0
