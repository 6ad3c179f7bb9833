"""A PDU that leaves later, or is forwarded: its times change, everything else stays."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.wire import (
    BROADCAST,
    CONTROL_TOPIC_ID,
    MAX_AGE_US,
    NO_AGE,
    Beacon,
    Clock,
    Entry,
    Frame,
    LinkReport,
    PduBuilder,
    Receipt,
    RegistryDigest,
    Repeat,
    Stamp,
    aged,
    build,
    build_records,
    depends_on_start,
    forwarded,
    identity,
    lasting_identity,
    parse,
    parse_records,
    postponed,
    with_seq,
)
from tests.laws import law
from tests.wire.pdus import sized_pdus
from tests.wire.vectors import BY_NAME, crc16_xmodem, reseal

octet = st.integers(0, 255)
u16 = st.integers(0, 0xFFFF)
times_us = st.integers(0, MAX_AGE_US) | st.integers(0, 10_000_000)
records = st.one_of(
    st.builds(Stamp, octet, octet, times_us),
    st.builds(Frame, octet, octet, st.integers(0, 0xFFFF), times_us),
    st.builds(Beacon, u16, u16, st.none() | st.integers(0, MAX_AGE_US)),
    st.builds(Repeat, octet, st.integers(0, MAX_AGE_US), u16, octet),
    st.builds(LinkReport, octet, st.integers(-128, 127), octet, octet),
    st.tuples(octet, octet, octet).map(lambda fields: Receipt(*fields)),
    st.builds(Receipt, octet, octet, octet, octet, u16, u16),
    st.tuples(u16, octet, octet, times_us).map(lambda fields: Clock(*fields, pdu_number=fields[0])),
    st.builds(RegistryDigest, st.binary(min_size=8, max_size=8), st.binary(max_size=15)),
)
units_us = times_us.map(lambda us: us // 100 * 100)
"""Times that the smaller fields can tell, too."""
steps_us = st.sampled_from([0, 1, 255, 256, 65_536, MAX_AGE_US]) | times_us


def moved(record, by_us, kinds=(Stamp, Frame, Repeat, Receipt)):
    if not isinstance(record, kinds):
        return record
    if isinstance(record, Stamp):
        return record._replace(age_us=min(record.age_us + by_us, MAX_AGE_US))
    if isinstance(record, Frame):
        return record._replace(phase_us=min(record.phase_us + by_us, MAX_AGE_US))
    if isinstance(record, Repeat):
        return record._replace(held_100us=min(record.held_100us + by_us // 100, 0xFFFF))
    if record[3:] == (BROADCAST, NO_AGE, 0):
        return record
    return record._replace(since_100us=min(record.since_100us + by_us // 100, 0xFFFF))


@st.composite
def built(draw):
    """(PDU as the link builds it, its size, its entries, its records)"""
    pdu_size = draw(st.sampled_from([32, 64, 220, 2047]))
    builder = PduBuilder(pdu_size)
    entries = []
    for _ in range(draw(st.integers(0, 14))):
        payload = draw(st.binary(max_size=min(max(builder.room, 0), 40)))
        if builder.room < len(payload):
            break
        entry = Entry(draw(st.integers(0, 14)), draw(octet), 0, 1, payload)
        builder.add(*entry)
        entries.append(entry)
    told = [each for each in draw(st.lists(records)) if builder.add_record(build_records([each]))]
    if builder.is_empty:
        builder.add_record(build_records([Stamp(1, 2, 3)]))
        told = [Stamp(1, 2, 3)]
    seq, hop = draw(octet), draw(st.integers(0, 15))
    return builder.build(0, 1, 255, seq, hop, draw(octet)), pdu_size, entries, told


@law(120)
@given(built(), steps_us)
def test_ages_and_phases_move_and_nothing_else(case, by_us):
    pdu, _, _, told = case
    same(case, postponed(pdu, by_us), [moved(record, by_us) for record in told])
    grown = [moved(record, by_us, (Stamp, Repeat, Receipt)) for record in told]
    same(case, aged(pdu, by_us), grown)
    ages = [moved(record, by_us, Stamp) for record in told]
    same(case, aged(pdu, by_us, only_ages=True), ages)


def same(case, after, told, **changed):
    """Assert that a PDU is as in a case, but for its records and header fields."""
    pdu, pdu_size, entries, _ = case
    before, now = parse(pdu, pdu_size), parse(after, pdu_size)
    assert crc16_xmodem(after[:-2]) == int.from_bytes(after[-2:], "big")
    assert now._replace(entries=before.entries) == before._replace(**changed)
    assert now.entries[: len(entries)] == entries
    if told:
        *_, control = now.entries
        assert control._replace(payload=b"") == before.entries[-1]._replace(payload=b"")
        assert parse_records(control.payload) == told


@law(120)
@given(built(), steps_us, st.booleans())
def test_what_is_forwarded_has_a_hop_less_and_older_messages(case, by_us, has_control):
    pdu, pdu_size, _, told = case
    hop = parse(pdu, pdu_size).hop
    if hop < 2:
        with pytest.raises(ValueError, match=f"{hop} hops left"):
            forwarded(pdu, by_us, has_control)
        return
    ages = [moved(record, by_us, Stamp) for record in told] if has_control else told
    same(case, forwarded(pdu, by_us, has_control), ages, hop=hop - 1)


@law(60)
@given(built(), steps_us, octet)
def test_a_pdu_is_known_again_however_long_relays_held_it(case, by_us, seq):
    pdu, pdu_size, _, told = case
    assert lasting_identity(aged(pdu, by_us, only_ages=True)) == lasting_identity(pdu)
    if not any(isinstance(record, Stamp) for record in told):
        assert lasting_identity(pdu) == identity(pdu)
    renamed = with_seq(pdu, seq)
    same(case, renamed, told, seq=seq)
    is_same = seq == parse(pdu, pdu_size).seq
    assert (lasting_identity(renamed) == lasting_identity(pdu)) == is_same
    other = bytearray(pdu)
    other[-3] ^= 1
    assert lasting_identity(bytes(other)) != lasting_identity(pdu) or told


@law(120)
@given(built())
def test_what_tells_the_time_of_its_own_start_fits_that_start_alone(case):
    pdu, _, _, told = case
    assert depends_on_start(pdu) == any(isinstance(record, Frame | Clock) for record in told)


@law(40)
@given(built())
def test_a_pdu_that_leaves_in_time_stays_as_it_is(case):
    assert postponed(case[0], 0) == case[0]


@law(40)
@given(built(), units_us, units_us)
def test_two_delays_are_one(case, first_us, second_us):
    assert postponed(postponed(case[0], first_us), second_us) == postponed(
        case[0], first_us + second_us
    )


@law(40)
@given(sized_pdus(), steps_us)
def test_messages_are_never_touched_whatever_they_look_like(case, by_us):
    """Payloads are random octets here; under topic id 0xF they would be records."""
    pdu, pdu_size = case
    kept = [entry._replace(topic_id=entry.topic_id % CONTROL_TOPIC_ID) for entry in pdu.entries]
    octets = build(pdu._replace(entries=kept), pdu_size)
    assert postponed(octets, by_us) == octets


@pytest.mark.parametrize("topic_id", range(CONTROL_TOPIC_ID))
def test_a_message_that_reads_like_records_is_a_message(topic_id):
    payload = build_records([Stamp(1, 2, 3), Frame(1, 0, 2, 3)])
    entries = [Entry(topic_id, 0, 0, 1, payload), Entry(topic_id, 1, 0, 1, payload)]
    pdu = parse(BY_NAME["three_odd_nibble"].octets, 48)._replace(entries=entries)
    assert postponed(build(pdu, 96), 1000) == build(pdu, 96)


def test_the_golden_vectors_a_second_apart():
    before = BY_NAME["message_stamp_and_frame"].octets
    after = BY_NAME["message_stamp_and_frame_a_second_later"].octets
    assert postponed(before, 1_000_000).hex(" ") == after.hex(" ")


@pytest.mark.parametrize("by_us", [1, 4_293_732_729, MAX_AGE_US])
def test_ages_end_at_the_largest(by_us):
    record = parse_records(
        parse(postponed(BY_NAME["stamp_alone"].octets, by_us), 32).entries[0].payload
    )
    assert record == [Stamp(14, 255, MAX_AGE_US)]


def test_every_control_entry_moves_and_unknown_records_are_stepped_over():
    payload = (
        bytes([200, 3, 1, 6, 9])
        + build_records([Stamp(1, 2, 100)])
        # A longer STAMP, with 2 more octets, as later versions may send.
        + bytes([1, 8, 3, 4, 0, 0, 0, 50, 7, 7])
    )
    stamp = build_records([Stamp(5, 6, 7)])
    entries = [
        Entry(CONTROL_TOPIC_ID, 0, 0, 1, payload),
        Entry(0, 5, 0, 1, b"abcd"),
        Entry(CONTROL_TOPIC_ID, 2, 0, 2, stamp),
        Entry(CONTROL_TOPIC_ID, 3, 0, 1, stamp + b"\1"),
        Entry(CONTROL_TOPIC_ID, 1, 0, 1, build_records([Frame(1, 0, 7, 10)])),
    ]
    pdu = parse(BY_NAME["three_odd_nibble"].octets, 48)._replace(entries=entries)
    first, message, *unreadable, last = parse(postponed(build(pdu, 120), 5), 120).entries
    assert unreadable == entries[2:4], "no record of an entry that is unreadable is used"
    assert first.payload[:5] == payload[:5]
    assert parse_records(first.payload) == [Stamp(1, 2, 105), Stamp(3, 4, 55, asks=True)]
    assert first.payload[-2:] == bytes([7, 7])
    assert message == entries[1]
    assert parse_records(last.payload) == [Frame(1, 0, 7, 15)]


@pytest.mark.parametrize(("size", "moves"), [(3, False), (7, False), (8, True), (9, True)])
def test_a_receipt_has_a_time_only_if_it_is_long_enough(size, moves):
    value = bytes(range(1, size + 1))
    entry = Entry(CONTROL_TOPIC_ID, 0, 0, 1, bytes([5, size]) + value)
    pdu = parse(BY_NAME["three_odd_nibble"].octets, 48)._replace(entries=[entry])
    (after,) = parse(aged(build(pdu, 48), 399), 48).entries
    told = value[:6] + (0x0708 + 3).to_bytes(2, "big") + value[8:] if moves else value
    assert after.payload[2:] == told


def test_the_yardstick_sees_a_wrong_crc():
    """The control: a PDU without an updated CRC is refused."""
    pdu = bytearray(postponed(BY_NAME["message_stamp_and_frame"].octets, 5))
    assert reseal(bytes(pdu)) == bytes(pdu)
    pdu[-1] ^= 1
    assert reseal(bytes(pdu)) != bytes(pdu)
