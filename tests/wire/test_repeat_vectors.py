"""PDU numbers, NEED and REPEAT, against octets that were written out by hand."""

from itertools import accumulate

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import PduError
from sdrlinkd.wire import (
    Arrival,
    Beacon,
    Clock,
    Need,
    Repeat,
    build,
    build_records,
    heard_number,
    is_newer_number,
    nearest_number,
    needs,
    parse,
    parse_records,
)
from tests.laws import law
from tests.wire.vectors import (
    BEACON_NUMBERED,
    BY_NAME,
    CLOCK_FIRST,
    CLOCK_NUMBERED,
    CONTROL,
    NEED,
    NEED_NUMBERS,
    NEED_WIDE,
    NEED_WIDE_NUMBERS,
    REPEAT,
    STAMP,
    reseal,
)

NUMBERS = 1 << 32
MAX_BITMAP = 16

CLOCK_WITH_ARRIVALS = Clock(
    0xBEEF,
    7,
    6,
    1_000_000_000,
    1 << 60,
    5,
    (Arrival(9, 0x0102, 2_500), Arrival(200, 0xFFFF, 21_474_836_470)),
    0xFFFFFFFF,
)
WIDE = bytes.fromhex("8001c000000000001200000000000001")
HELD = [
    (BEACON_NUMBERED, [Beacon(0xBEEF, 513, 100_005)]),
    (CLOCK_NUMBERED, [CLOCK_WITH_ARRIVALS]),
    (CLOCK_FIRST, [Clock(1, 0, 0, 0, -(1 << 63), 0, (), 0)]),
    (NEED, [Need(3, 300, b"\xa1")]),
    (NEED_WIDE, [Need(3, 0xFFFFFFF0, WIDE)]),
    (REPEAT, [Repeat(1, 300, 1234, 2)]),
]
PDU_NAMES = [
    "beacon_numbered",
    "clock_numbered",
    "clock_and_need",
    "need_and_repeat",
    "message_and_repeat",
]

octet = st.integers(0, 255)
u32 = st.integers(0, NUMBERS - 1)
near_the_wrap = st.integers(-300, 300).map(lambda number: number % NUMBERS)
pdu_numbers = u32 | near_the_wrap
each_record = pytest.mark.parametrize(
    ("vector", "records"), HELD, ids=[vector.name for vector, _ in HELD]
)


@st.composite
def missing_numbers(draw):
    """Ascending numbers of PDUs, which may pass 2**32."""
    steps = draw(st.lists(st.integers(1, 300), max_size=40))
    return list(accumulate(steps, initial=draw(pdu_numbers)))


@each_record
def test_records_have_these_octets(vector, records):
    assert build_records(records).hex(" ") == vector.payload.hex(" ")
    assert parse_records(vector.payload) == records


@pytest.mark.parametrize("name", PDU_NAMES)
def test_pdus_have_these_octets(name):
    vector = BY_NAME[name]
    pdu = parse(vector.octets, vector.pdu_size)
    assert [tuple(entry) for entry in pdu.entries] == [tuple(entry) for entry in vector.entries]
    assert build(pdu, vector.pdu_size).hex(" ") == vector.octets.hex(" ")


@pytest.mark.parametrize("name", PDU_NAMES)
def test_records_of_the_pdus_build_the_same_pdus(name):
    vector = BY_NAME[name]
    pdu = parse(vector.octets, vector.pdu_size)
    entries = [
        entry._replace(payload=build_records(parse_records(entry.payload)))
        if entry.topic_id == CONTROL
        else entry
        for entry in pdu.entries
    ]
    assert build(pdu._replace(entries=entries), vector.pdu_size) == vector.octets


def test_a_pdu_tells_its_own_number():
    for name, number in [
        ("beacon_numbered", 100_005),
        ("clock_numbered", 0xFFFFFFFF),
        ("clock_and_need", 0),
    ]:
        vector = BY_NAME[name]
        pdu = parse(vector.octets, vector.pdu_size)
        told = parse_records(pdu.entries[0].payload)[0]
        assert told.pdu_number == number
        assert nearest_number(number, pdu.seq) == number


def test_a_flipped_bit_of_a_repeat_is_refused():
    vector = BY_NAME["need_and_repeat"]
    octets = bytearray(vector.octets)
    octets[octets.index(REPEAT.payload) + len(REPEAT.payload) - 1] ^= 1
    with pytest.raises(PduError) as refused:
        parse(bytes(octets), vector.pdu_size)
    assert refused.value.reason == "rx_crc"
    found = parse_records(parse(reseal(bytes(octets)), vector.pdu_size).entries[0].payload)
    assert found[1] == Repeat(1, 300, 1234, 3)


@pytest.mark.parametrize(
    ("vector", "numbers"), [(NEED, NEED_NUMBERS), (NEED_WIDE, NEED_WIDE_NUMBERS)]
)
def test_numbers_of_a_bitmap(vector, numbers):
    (need,) = parse_records(vector.payload)
    assert tuple(need.numbers()) == numbers


@pytest.mark.parametrize("bit", range(8 * MAX_BITMAP))
def test_each_bit_of_a_bitmap_stands_for_one_number(bit):
    bitmap = bytearray(MAX_BITMAP)
    bitmap[bit // 8] = 0x80 >> bit % 8
    assert list(Need(3, 0xFFFFFFF0, bytes(bitmap)).numbers()) == [(0xFFFFFFF0 + bit) % NUMBERS]


def test_a_bitmap_of_zeros_asks_for_nothing():
    assert list(Need(3, 300, bytes(MAX_BITMAP)).numbers()) == []


def test_octets_behind_sixteen_of_a_bitmap_are_ignored():
    payload = bytes([10, 22]) + NEED_WIDE.payload[2:] + b"\xff"
    assert parse_records(payload) == parse_records(NEED_WIDE.payload)


def test_octets_behind_the_fields_of_repeat_are_ignored():
    payload = bytes([18, 11]) + REPEAT.payload[2:] + b"\xff\xff\xff"
    assert parse_records(payload + STAMP.payload) == [
        *parse_records(REPEAT.payload),
        *parse_records(STAMP.payload),
    ]


def test_clock_without_its_number():
    payload = bytearray(CLOCK_NUMBERED.payload[:-4])
    payload[1] -= 4
    assert parse_records(bytes(payload)) == [CLOCK_WITH_ARRIVALS._replace(pdu_number=None)]


def test_beacon_without_its_number():
    payload = bytearray(BEACON_NUMBERED.payload[:-4])
    payload[1] -= 4
    assert parse_records(bytes(payload)) == [Beacon(0xBEEF, 513)]


def test_needs_of_the_vectors():
    assert needs(3, list(NEED_NUMBERS)) == parse_records(NEED.payload)
    first = NEED_WIDE_NUMBERS[0]
    ascending = [first + (number - first) % NUMBERS for number in NEED_WIDE_NUMBERS]
    assert needs(3, ascending) == parse_records(NEED_WIDE.payload)


def test_no_numbers_need_no_record():
    assert needs(3, []) == []


@law(60)
@given(octet, missing_numbers())
def test_needs_ask_for_exactly_these_numbers(node, numbers):
    found = needs(node, numbers)
    assert all(need.node == node for need in found)
    assert all(1 <= len(need.bitmap) <= MAX_BITMAP for need in found)
    asked = [number for need in found for number in need.numbers()]
    assert len(asked) == len(set(asked))
    assert set(asked) == {number % NUMBERS for number in numbers}


@law(60)
@given(octet, st.sets(pdu_numbers, max_size=40).map(sorted))
def test_needs_of_numbers_far_apart(node, numbers):
    asked = [number for need in needs(node, numbers) for number in need.numbers()]
    assert sorted(asked) == numbers


@law(60)
@given(missing_numbers(), st.integers(1, 20))
def test_a_bitmap_reaches_as_far_as_it_may_and_no_farther(numbers, most):
    found, reach = needs(3, numbers, most), 8 * min(most, MAX_BITMAP)
    firsts = [need.number for need in found]
    expected = []
    for number in numbers:
        if not expected or number - expected[-1] >= reach:
            expected.append(number)
    assert firsts == [number % NUMBERS for number in expected]
    assert all(len(need.bitmap) <= min(most, MAX_BITMAP) for need in found)
    assert all(need.bitmap[0] >= 0x80 for need in found)
    assert all(need.bitmap[-1] for need in found), "no octet too much"


def test_number_0_is_asked_for():
    assert needs(3, [0]) == [Need(3, 0, b"\x80")]
    for most, reach in ((1, 8), (15, 120), (16, 128), (17, 128)):
        assert [len(needs(3, [0, off], most)) for off in (reach - 1, reach)] == [1, 2]
    assert needs(3, [0, 9, 300]) == [Need(3, 0, b"\x80\x40"), Need(3, 300, b"\x80")]


@pytest.mark.parametrize(
    ("number", "last", "is_newer"),
    [
        (1, 0, True), (0, 0, False), (0, 1, False), (0x7FFF, 0, True), (0x8000, 0, False),
        (0, 0xFFFF, True), (0xFFFF, 0, False),
    ],
)  # fmt: skip
def test_numbers_of_flows_wrap_around(number, last, is_newer):
    assert is_newer_number(number, last) == is_newer


@law(60)
@given(st.integers(0, 3 * NUMBERS), st.integers(-(1 << 31), (1 << 31) - 1))
def test_a_told_number_is_the_nearest_in_the_count(known, step):
    assert heard_number(known, (known + step) % NUMBERS) == known + step


@law(60)
@given(octet, missing_numbers())
def test_needs_outlive_the_air(node, numbers):
    sent = needs(node, numbers)
    assert parse_records(build_records(sent)) == sent


@law(60)
@given(octet, pdu_numbers, st.binary(min_size=1, max_size=MAX_BITMAP))
def test_numbers_are_the_ones_of_the_bitmap(node, number, bitmap):
    bits = "".join(f"{octet:08b}" for octet in bitmap)
    expected = [(number + place) % NUMBERS for place, bit in enumerate(bits) if bit == "1"]
    assert list(Need(node, number, bitmap).numbers()) == expected


@pytest.mark.parametrize(
    ("known", "seq", "number"),
    [
        (300, 44, 300),
        (300, 45, 301),
        (300, 43, 299),
        (300, 171, 427),  # 127 ahead
        (300, 173, 173),  # 127 behind
        (255, 0, 256),
        (256, 255, 255),
        (0xFFFFFFFF, 0, 0),
        (0xFFFFFFFF, 126, 126),
        (0, 255, 0xFFFFFFFF),
        (0, 129, 0xFFFFFF81),
    ],
)
def test_nearest_number(known, seq, number):
    assert nearest_number(known, seq) % NUMBERS == number


@law(60)
@given(pdu_numbers, octet)
def test_the_nearest_number_has_this_seq_and_none_is_nearer(known, seq):
    number = nearest_number(known, seq)
    assert number % 256 == seq
    assert abs(number - known) <= 128


@law(60)
@given(pdu_numbers, st.integers(-127, 127))
def test_less_than_half_a_turn_of_seq_is_followed(known, step):
    number = known + step
    assert nearest_number(known, number % 256) % NUMBERS == number % NUMBERS
