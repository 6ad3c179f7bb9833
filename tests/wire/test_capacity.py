"""The paper's arithmetic: B, k*, L_pad, and what follows from them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.wire import (
    MAX_PDU_SIZE,
    MIN_PDU_SIZE,
    PARTS,
    Entry,
    Pdu,
    PduBuilder,
    build,
    build_full,
    entry_budget,
    equal_payload,
    fragment_count,
    max_message_size,
    pad_length,
    parse,
)
from tests.laws import law

EVERY_SIZE = range(MIN_PDU_SIZE, MAX_PDU_SIZE + 1)


@pytest.mark.parametrize(
    ("pdu_size", "n", "budget", "k"),
    [
        (220, 1, 212, 207),
        (220, 2, 212, 101),
        (220, 3, 211, 65),
        (220, 4, 211, 47),
        (220, 15, 205, 8),
        (64, 1, 56, 51),
        (64, 2, 56, 23),
        (32, 1, 24, 19),
        (32, 2, 24, 7),
        (32, 3, 23, 2),
        (32, 4, 23, 0),
        (32, 5, 22, -1),
        (90, 15, 75, 0),
        (2047, 1, 2039, 2034),
        (2047, 15, 2032, 130),
    ],
)
def test_budget_and_equal_payload(pdu_size, n, budget, k):
    assert entry_budget(pdu_size, n) == budget
    assert equal_payload(pdu_size, n) == k


def test_single_entry():
    assert all(equal_payload(pdu_size, 1) == pdu_size - 13 for pdu_size in EVERY_SIZE)


@pytest.mark.parametrize(
    ("pdu_size", "payload_sizes", "pad"),
    [
        (220, [101, 101], 0),
        (220, [101, 99], 2),
        (220, [207], 0),
        (220, [0], 207),
        (220, [208], -1),
        (32, [6], 13),
        (48, [2, 0, 3], 19),
        (110, [1] * 15, 5),
        (32, [0] * 15, -58),
    ],
)
def test_pad_length(pdu_size, payload_sizes, pad):
    assert pad_length(pdu_size, payload_sizes) == pad


@law()
@given(st.sampled_from(EVERY_SIZE), st.lists(st.integers(0, 300), min_size=1, max_size=15))
def test_a_pdu_fits_exactly_when_pad_is_not_negative(pdu_size, payload_sizes):
    entries = [Entry(0, 0, 0, 1, bytes(k)) for k in payload_sizes]
    pdu = Pdu(0, False, 0, 255, 0, 1, entries)
    if pad_length(pdu_size, payload_sizes) < 0:
        with pytest.raises(ValueError, match="bytes"):
            build(pdu, pdu_size)
    else:
        assert len(build(pdu, pdu_size)) == pdu_size


@pytest.mark.parametrize("n", range(1, 16))
def test_equal_payload_is_the_most_that_fits(n):
    for pdu_size in EVERY_SIZE:
        k = equal_payload(pdu_size, n)
        assert pad_length(pdu_size, [k] * n) >= 0 > pad_length(pdu_size, [k + 1] * n)


@pytest.mark.parametrize(
    ("pdu_size", "size"), [(32, 4_845), (64, 13_005), (220, 52_785), (2047, 518_670)]
)
def test_max_message_size(pdu_size, size):
    assert max_message_size(pdu_size) == size
    assert fragment_count(size, pdu_size - 13) == 255
    assert fragment_count(size + 1, pdu_size - 13) == 256


@pytest.mark.parametrize(
    ("size", "k", "count"),
    [(0, 19, 1), (1, 19, 1), (19, 19, 1), (20, 19, 2), (38, 19, 2), (39, 19, 3), (720, 101, 8)],
)
def test_fragment_count(size, k, count):
    assert fragment_count(size, k) == count


steps = st.lists(st.integers(0, 30) | st.binary(min_size=2, max_size=30), max_size=18)
"""Entries of a number of octets, and records."""


def filled(pdu_size, steps):
    """A builder with as many of the entries and records as fit."""
    builder = PduBuilder(pdu_size)
    for step in steps:
        if isinstance(step, bytes):
            builder.add_record(step)
        elif step <= builder.room:
            builder.add(3, 1, 0, 1, bytes(step))
    return builder


def fits(builder, size, with_stamp):
    try:
        builder.add(3, 1, 0, 1, bytes(size))
    except ValueError:
        return False
    return not with_stamp or builder.add_stamp(3, 1, 5)


@law(150)
@given(st.sampled_from((32, 48, 110, 220, 301)), steps)
def test_a_builder_knows_its_room(pdu_size, steps):
    """The largest payload that fits, and that fits with its STAMP."""
    builder = filled(pdu_size, steps)
    for with_stamp, room in ((False, builder.room), (True, builder.room_beside_stamp)):
        for size in range(max(0, room - 1), max(0, room) + 2):
            assert fits(filled(pdu_size, steps), size, with_stamp) == (size <= room), size
    assert builder.is_empty == (builder.room == pdu_size - 13)
    if not builder.is_empty:
        entries = parse(builder.build(0, 1, 2, 3, 4, 99), pdu_size).entries
        records = [each for each in entries if each.topic_id == 15]
        assert [each[1:4] for each in records] in ([], [(99, 0, 1)])
        assert records == entries[len(entries) - len(records) :]


@pytest.mark.parametrize("topic_id", [0, 15, 16, 255, PARTS])
def test_a_pdu_with_one_entry_is_built_at_once(topic_id):
    entry = (topic_id, 3, 4, 5, b"abcdef")
    builder = PduBuilder(13 + 6 + (topic_id > 15))
    builder.add(*entry)
    octets = builder.build(8, 1, 2, 6, 7)
    assert build_full(8, 1, 2, 6, 7, *entry) == octets
    (told,) = parse(octets, len(octets)).entries
    if topic_id > 15:
        topic_id, ahead = 14, b"\0" if topic_id == PARTS else bytes([topic_id])
        entry = (topic_id, 3, 4, 5, ahead + b"abcdef")
    assert told == entry
