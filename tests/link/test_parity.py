"""Messages whose lost PDUs are reconstructed from the others."""

from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from sdrlinkd.link import Outcome, Overrides, Qos, ReassemblyParams
from sdrlinkd.link.packing import parity_records
from sdrlinkd.wire import Entry, Pdu, build, parse
from tests.laws import law
from tests.link.images import images_over, pdus_of, protected
from tests.link.world import compose, received, rx, topic_of


@law(60)
@given(
    size=st.integers(1, 70_000), pdu_size=st.sampled_from((220, 528, 1024, 1500, 2047)),
    share=st.floats(0.01, 0.5), seed=st.integers(0, 2**32),
)  # fmt: skip
def test_any_pattern_of_lost_fragments_that_parity_can_tell_is_repaired(
    size, pdu_size, share, seed
):
    rng = Random(seed)
    payload = b"\0\1\0\0" + rng.randbytes(size)
    sender, receiver = protected(share, pdu_size=pdu_size), protected(0.0, 2, pdu_size=pdu_size)
    pdus = pdus_of(sender, payload)
    if not pdus:
        assert topic_of(sender, 0).dropped["tx_too_big"]
        return
    data = [pdu for pdu in pdus if any(e.topic_id == 0 for e in parse(pdu, pdu_size).entries)]
    total = parse(data[0], pdu_size).entries[0].total
    most = min(-(-int(1e6 * share * total) // 10**6), 256 - total) if total >= 4 else 0
    lost = set(rng.sample(data, rng.randint(0, min(most, len(data)))))
    got = [m for pdu in pdus if pdu not in lost for m in receiver.hear(pdu, 0.0)]
    assert [m.payload for m in got] == [payload]
    assert receiver.audit() == sender.audit() == []
    assert rx(receiver).held == 0


def test_one_more_lost_than_there_is_parity_is_too_many():
    sender, receiver = protected(0.1, pdu_size=1024), protected(0.0, 2, pdu_size=1024)
    pdus = pdus_of(sender, bytes(64_000))
    assert [m for pdu in pdus[8:] for m in receiver.hear(pdu, 0.0)] == []
    receiver.handle_timers(1.0)
    assert received(receiver)[1, 0].dropped == {"rx_partial_timeout": 1}


def test_parity_costs_what_was_asked_for_and_without_it_there_is_none():
    pdus = [len(pdus_of(protected(share, pdu_size=1024), bytes(64_000))) for share in (0.0, 0.1)]
    assert pdus[0] == 64
    assert pdus[1] == pytest.approx(72, abs=1)


def test_small_messages_have_none():
    assert parity_records(bytes(3000), 1000, 3, (0, 0), 0.5, 1000) == []


def test_what_is_sent_is_only_sent_when_its_parity_is():
    sender = protected(0.5, pdu_size=64)
    sender.submit(0, bytes(400), 0.0, Overrides(Qos.BULK))
    bursts = []
    while burst := compose(sender, 0.0, 1):
        bursts.append(burst)
    for burst in bursts[:-1]:
        sender.confirm(burst, Outcome.SENT, 0.0)
    assert topic_of(sender, 0).sent == 0
    sender.confirm(bursts[-1], Outcome.SENT, 0.0)
    assert topic_of(sender, 0).sent == 1
    assert sender.audit() == []


@pytest.mark.slow
def test_records_that_contradict_their_message_or_themselves_do_no_harm():
    """At the same time, every third message loses two fragments and has valid parity."""
    rng = Random(4)
    sender = protected(0.3, pdu_size=220, beacon_s=0.0)
    receiver = protected(0.0, 2, pdu_size=220)
    records = parity_records(bytes(2000), 200, 10, (1, 0), 0.3, 200)
    sent, got = [], []
    for i in range(300):
        now = i * 0.02
        record = bytearray(rng.choice(records))
        for _ in range(3):
            record[rng.randrange(2, 15)] = rng.randrange(256)
        entries = [Entry(15, 0, 0, 1, bytes(record))]
        if rng.random() < 0.5:
            entries = [Entry(1, rng.randrange(4), rng.randrange(10), 10, bytes(rng.randrange(190)))]
        forged = build(Pdu(2, False, 1, 255, rng.randrange(256), 1, entries), 220)
        sent.append(b"\0\1\0\0" + rng.randbytes(1500))
        pdus = pdus_of(sender, sent[-1], now)
        kept = pdus[2:] if i % 3 == 0 else pdus
        for pdu in [forged, *kept]:
            got += [m.payload for m in receiver.hear(pdu, now) if m.topic_id == 0]
        receiver.handle_timers(now)
        assert receiver.audit() == []
    assert set(got) <= set(sent)
    assert len(got) > 280


@pytest.mark.slow
def test_parity_of_a_message_that_is_complete_is_no_part_of_the_next():
    """Entry ids are reused, and images often have the same size."""
    rng = Random(5)
    sender, receiver = protected(0.2, pdu_size=220), protected(0.0, 2, pdu_size=220)
    for i in range(600):
        payload = b"\0\1\0\0" + rng.randbytes(2000)
        now = i * 0.7
        pdus = pdus_of(sender, payload, now)
        lost = set(rng.sample(range(8), 2)) if i % 2 else set()
        heard = [pdu for number, pdu in enumerate(pdus) if number not in lost]
        assert [m.payload for pdu in heard for m in receiver.hear(pdu, now)] == [payload]
        assert rx(receiver).held_bytes == 0
        receiver.handle_timers(now)


@pytest.mark.slow
def test_memory_is_bounded_whatever_comes():
    receiver = protected(0.0, 2, pdu_size=2047, reassembly=ReassemblyParams(total_bytes=8 << 20))
    for src in range(3, 250):
        sender = protected(1.0, src, pdu_size=2047)
        for pdu in pdus_of(sender, bytes(60_000))[20:40]:
            receiver.hear(pdu, 0.0)
    assert 4 << 20 < rx(receiver).held_bytes <= 8 << 20
    assert receiver.audit() == []


def fading(seed, n):
    """Whether each of `n` PDUs is lost: 7 %, at the minima of a slowly varying level."""
    rng = np.random.default_rng(seed)
    strength = lfilter([1.0], [1.0, -0.6], rng.standard_normal(n))
    return strength < np.quantile(strength, 0.07)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_over_fading_links_memory_is_bounded_and_parity_helps(seed):
    lost = fading(seed, 6000)
    assert lost.mean() == pytest.approx(0.07, abs=0.001)
    got = {share: images_over(lost, share) for share in (0.0, 0.2)}
    assert got[0.2] > got[0.0] + 5
