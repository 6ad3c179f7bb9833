"""Unreadable control entries of other robots only affect themselves."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import PduError
from sdrlinkd.wire import (
    CONTROL_TOPIC_ID,
    Beacon,
    Entry,
    Pdu,
    Stamp,
    build,
    build_records,
    forwarded,
    parse,
    parse_records,
    postponed,
)
from tests.laws import law
from tests.link.world import make_link, neighbors, rx

SIZE = 220
MESSAGE = b"\0\1\0\0data"
SPOILT = build_records([Beacon(7, 1), Stamp(0, 9, 5_000_000)]) + b"\4\4\6"
"""Readable records, followed by one that is cut."""


def control(payload, total=1):
    return Entry(CONTROL_TOPIC_ID, 3, 0, total, payload)


def pdu(entries, seq=0, hop=1, dst=255):
    return build(Pdu(0, False, 1, dst, seq, hop, entries), SIZE)


def data(entry_id=9, payload=MESSAGE):
    return Entry(0, entry_id, 0, 1, payload)


def readable(entry):
    try:
        parse_records(entry.payload)
    except PduError:
        return False
    return entry.total == 1


# Random octets, and octets that begin like records.
payloads = st.binary(max_size=60) | st.builds(
    lambda kind, length, rest: bytes((kind, length)) + rest,
    st.integers(0, 12),
    st.integers(0, 40),
    st.binary(max_size=40),
)
foreign = st.builds(control, payloads, st.sampled_from([1, 1, 1, 2, 255]))


@pytest.mark.slow
@law(300)
@given(st.lists(st.lists(foreign, min_size=1, max_size=2), min_size=1, max_size=6), st.booleans())
def test_whatever_is_said_on_topic_15_the_message_beside_it_is_delivered(cases, behind):
    link = make_link(2, pdu_size=SIZE)
    bad = 0
    for seq, foreigners in enumerate(cases):
        message = data(entry_id=seq, payload=MESSAGE + bytes([seq]))
        entries = [message, *foreigners] if behind else [*foreigners, message]
        got = link.hear(pdu(entries, seq), 0.0)
        assert [each.payload for each in got] == [message.payload]
        bad += sum(not readable(each) for each in foreigners)
        assert link.audit() == []
    rx = link.report(0.0).rx
    assert (rx.pdus_used, rx.delivered, rx.control_bad) == (len(cases), len(cases), bad)


def test_a_good_control_entry_beside_a_bad_one_is_used():
    link = make_link(2, pdu_size=SIZE)
    good = control(build_records([Stamp(0, 9, 250_000)]))
    (got,) = link.hear(pdu([control(SPOILT), data(), good]), 1.0)
    assert got.origin_at == 1.0 - 0.25
    assert rx(link).control_bad == 1


def test_of_a_bad_entry_no_record_is_used():
    link = make_link(2, pdu_size=SIZE)
    (got,) = link.hear(pdu([data(), control(SPOILT)]), 1.0)
    # Neither its STAMP nor its BEACON takes effect.
    assert got.origin_at is None
    link.hear(pdu([control(build_records([Beacon(8, 1)]))], seq=1), 1.1)
    assert neighbors(link)[1].reboots == 0


def test_copies_do_not_count_again():
    link = make_link(2, pdu_size=SIZE)
    for _ in range(2):
        link.hear(pdu([data(), control(SPOILT)]), 1.0)
    assert rx(link).control_bad == 1
    assert dict(rx(link).pdus_dropped) == {"rx_dup": 1}


def test_pdus_of_control_entries_alone():
    link = make_link(2, pdu_size=SIZE)
    good = control(build_records([Beacon(7, 1)]))
    for seq, entries in enumerate(([control(SPOILT)] * 2, [control(SPOILT), good], [good] * 2)):
        assert link.hear(pdu(entries, seq), 0.0) == []
    assert dict(rx(link).pdus_dropped) == {"rx_control_bad": 1, "rx_control": 2}
    assert rx(link).control_bad == 3
    assert link.audit() == []


def test_with_sixteen_topics_there_is_nothing_to_be_read():
    link = make_link(2, pdu_size=SIZE, topics=[(f"t{i}", "a/B") for i in range(16)])
    got = link.hear(pdu([control(SPOILT), data()]), 0.0)
    assert [each.topic_id for each in got] == [15, 0]
    assert rx(link).control_bad == 0


@pytest.mark.slow
@law(200)
@given(st.lists(foreign, min_size=1, max_size=3), st.integers(0, 10_000_000))
def test_a_relay_sends_on_as_it_is_what_it_cannot_read(foreigners, by_us):
    octets = pdu([*foreigners, data()], hop=3)
    for moved in (forwarded(octets, by_us, has_control=True), postponed(octets, by_us)):
        after = parse(moved, SIZE).entries
        for before, now in zip(foreigners, after, strict=False):
            assert now == before or readable(before)
        assert after[-1] == data()
    link = make_link(2, pdu_size=SIZE, hop_limit=3)
    assert len(link.hear(octets, 0.0)) == 1
    assert link.hear(forwarded(octets, by_us, has_control=True), 0.1) == []
    assert rx(link).pdus_dropped["rx_dup"] == 1
