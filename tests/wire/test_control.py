"""Control records: a sequence of type, length, value."""

from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import PduError
from sdrlinkd.wire import (
    MAX_AGE_US,
    MAX_ARRIVALS,
    NO_AGE,
    Admit,
    Arrival,
    Bare,
    Beacon,
    Clock,
    Contact,
    Flows,
    FoundNumbers,
    Frame,
    Grant,
    KeyTold,
    LinkReport,
    LostNumbers,
    Lsa,
    Met,
    Need,
    Parity,
    RatesAsked,
    Receipt,
    RegistryDigest,
    Repeat,
    ReservedFlow,
    Route,
    Stamp,
    TopicPiece,
    Waits,
    Want,
    Wanted,
    build_records,
    parse_records,
    period_code,
    period_s,
    tellable,
)
from tests.laws import law, trials
from tests.wire.vectors import RECORDS

SEED = 6
CASES = trials(20_000)

# Number of octets that the fields of each type need (clause 6).
NEED = {
    1: 6,
    2: 4,
    3: 8,
    4: 4,
    5: 3,
    6: 13,
    7: 8,
    8: 24,
    9: 4,
    10: 6,
    11: 5,
    12: 6,
    13: 3,
    14: 6,
    15: 4,
    17: 1,
    18: 8,
    19: 8,
    20: 5,
    21: 2,
    22: 3,
    23: 5,
    27: 13,
    28: 17,
    29: 1,
}

octet = st.integers(0, 255)
u16 = st.integers(0, 0xFFFF)
u32 = st.integers(0, (1 << 32) - 1)
i31 = st.integers(-(1 << 31) + 1, (1 << 31) - 1)
RESERVED = st.builds(
    ReservedFlow, octet, octet, st.integers(0, 3), st.integers(0, 127), u16, u32, u32
)
records = st.one_of(
    st.builds(Stamp, octet, octet, st.integers(0, MAX_AGE_US), st.booleans()),
    st.builds(Waits, octet, octet, octet, octet),
    st.builds(
        TopicPiece, octet, u16, st.integers(0, 15), st.integers(0, 15), st.binary(max_size=200)
    ),
    st.builds(Wanted, octet, st.binary(max_size=250)),
    st.builds(
        Contact,
        st.binary(min_size=8, max_size=8),
        st.lists(st.builds(Met, octet, st.binary(min_size=4, max_size=4), i31), max_size=27).map(
            tuple
        ),
    ),
    st.builds(KeyTold, st.integers(0, 3), st.booleans(), st.binary(min_size=4, max_size=4)),
    st.builds(
        LostNumbers,
        st.integers(0, 3),
        st.binary(min_size=4, max_size=4),
        st.binary(min_size=8, max_size=8),
    ),
    st.builds(
        FoundNumbers,
        octet,
        st.binary(min_size=8, max_size=8),
        st.integers(0, 3),
        st.integers(0, (1 << 30) - 1),
        st.none() | st.integers(0, (1 << 32) - 2),
    ),
    st.builds(RatesAsked, octet, st.lists(st.tuples(octet, octet), max_size=127).map(tuple)),
    st.builds(
        Clock,
        u16,
        u16,
        u16,
        st.integers(0, (1 << 64) - 1),
        st.integers(-(1 << 63), (1 << 63) - 1),
        u16,
        st.lists(
            st.builds(Arrival, octet, u16, i31.map(lambda ticks: 10 * ticks)),
            max_size=MAX_ARRIVALS - 1,
        ).map(tuple),
        st.none() | u32,
    ),
    st.builds(Beacon, u16, u16, st.none() | u32),
    st.builds(Need, octet, u32, st.binary(min_size=1, max_size=16)),
    st.builds(Bare, octet, st.binary(min_size=1, max_size=16)),
    st.builds(
        Want, octet, st.integers(0, 3), st.integers(0, 127), st.integers(0, 127), octet, octet
    ),
    st.builds(Grant, octet, octet, u32, st.lists(st.tuples(octet, octet), max_size=124).map(tuple)),
    st.builds(Flows, octet, u16, st.lists(RESERVED, max_size=18).map(tuple)),
    st.builds(Admit, octet, u16, octet, st.binary(max_size=125), st.binary(max_size=125)),
    st.builds(Lsa, octet, u16, st.lists(st.tuples(octet, octet), max_size=126).map(tuple)),
    st.builds(Route, octet, octet, u32, st.binary(max_size=249)),
    st.builds(Repeat, octet, u32, u16, octet),
    st.builds(LinkReport, octet, st.integers(-128, 127), octet, octet),
    st.tuples(octet, octet, octet).map(lambda fields: Receipt(*fields)),
    st.builds(Receipt, octet, octet, octet, octet, u16, u16),
    st.builds(Frame, octet, octet, st.integers(0, 0xFFFF), st.integers(0, MAX_AGE_US)),
    st.builds(
        Parity,
        octet,
        octet,
        octet,
        octet,
        octet,
        octet,
        st.integers(0, 0xFFFF),
        st.integers(0, 0xFFFFFFFF),
        st.binary(max_size=242),
    ),
    st.builds(RegistryDigest, st.binary(min_size=8, max_size=8), st.binary(max_size=247)),
)
closed = st.one_of(
    st.builds(Waits, octet, octet, octet, octet),
    st.builds(LinkReport, octet, st.integers(-128, 127), octet, octet),
    st.builds(Frame, octet, octet, u16, st.integers(0, MAX_AGE_US)),
    st.builds(Repeat, octet, u32, u16, octet),
)
"""Records whose fields end where they end."""
unknown = st.builds(
    lambda kind, value: bytes([kind, len(value)]) + value,
    octet.filter(lambda kind: kind not in NEED),
    st.binary(max_size=255),
)


@law()
@given(st.lists(records))
def test_parse_undoes_build(sent):
    assert parse_records(build_records(sent)) == sent


@law()
@given(st.lists(st.tuples(unknown, records)), unknown)
def test_unknown_types_are_skipped(pairs, last):
    payload = b"".join(skipped + build_records([record]) for skipped, record in pairs) + last
    assert parse_records(payload) == [record for _, record in pairs]


@pytest.mark.parametrize("kind", [0, 16, 24, 255])
def test_reserved_types_are_skipped(kind):
    assert parse_records(bytes([kind, 2, 1, 6, 5, 3, 1, 2, 3])) == [Receipt(1, 2, 3)]


@law()
@given(
    closed,
    st.binary(max_size=200),
    st.lists(records),
)
def test_longer_known_records_are_accepted(record, more, rest):
    payload = bytearray(build_records([record]) + more)
    payload[1] += len(more)
    assert parse_records(bytes(payload) + build_records(rest)) == [record, *rest]


def test_octets_behind_the_fields_of_stamp_receipt_clock_and_beacon():
    stamp, receipt = bytes([1, 2, 0, 0, 0, 3]), bytes([1, 2, 3])
    clock = build_records([Clock(1, 2, 3, 4)])[2:]

    def parsed(kind, value):
        return parse_records(bytes([kind, len(value)]) + value)

    assert parsed(1, stamp + b"\x01") == [Stamp(1, 2, 3, asks=True)]
    assert parsed(1, stamp + b"\xfe\x07\x07") == [Stamp(1, 2, 3)]
    assert parsed(5, receipt + b"\x04\x05\x06\x07") == [Receipt(1, 2, 3)]
    whole = receipt + b"\x04\x05\x06\x07\x08"
    assert parsed(5, whole + b"\x09") == [Receipt(1, 2, 3, 4, 0x0506, 0x0708)]
    assert parsed(8, clock + bytes(6)) == [Clock(1, 2, 3, 4)]
    told = b"\x07\x00\x08\xff\xff\xff\xfe"
    arrivals = (Arrival(7, 8, -20),)
    assert parsed(8, clock + told + bytes(6)) == [Clock(1, 2, 3, 4, arrivals=arrivals)]
    number = b"\x01\x02\x03\x04"
    assert parsed(8, clock + number) == [Clock(1, 2, 3, 4, pdu_number=0x01020304)]
    numbered = Clock(1, 2, 3, 4, arrivals=arrivals, pdu_number=0x01020304)
    assert parsed(8, clock + told + number) == [numbered]
    assert parsed(2, bytes(4) + number[:3]) == [Beacon(0, 0)]
    assert parsed(2, bytes(4) + number + b"\xff") == [Beacon(0, 0, 0x01020304)]
    assert parsed(10, bytes(6) + bytes(20)) == [Need(0, 0, bytes(16))]


@pytest.mark.parametrize(
    ("kind", "size"), [(kind, size) for kind, need in NEED.items() for size in range(need)]
)
def test_short_known_record(kind, size):
    # The payload would have room for the missing octets.
    refused(bytes([kind, size]) + bytes(size) + bytes([200, 10]) + bytes(10))


@pytest.mark.parametrize("kind", [*NEED, 11, 200])
def test_record_that_overruns(kind):
    need = NEED.get(kind, 3)
    refused(bytes([kind]))
    refused(bytes([kind, need]) + bytes(need - 1))
    refused(bytes([kind, 255]) + bytes(254))


def test_one_bad_record_spoils_all():
    good = build_records([Stamp(1, 2, 3)])
    assert parse_records(good + good) == [Stamp(1, 2, 3), Stamp(1, 2, 3)]
    refused(good + b"\x01")
    refused(good + bytes([2, 3, 0, 0, 0]))


@pytest.mark.parametrize("vector", RECORDS, ids=lambda v: v.name)
def test_any_truncation_between_records_is_refused(vector):
    sizes = set()
    at = 0
    while at < len(vector.payload):
        sizes.add(at)
        at += 2 + vector.payload[at + 1]
    for size in range(len(vector.payload)):
        if size in sizes:
            parse_records(vector.payload[:size])
        else:
            refused(vector.payload[:size])


def test_any_bytes_are_records_or_refused():
    rng = Random(SEED)
    parsed = 0
    for case in range(CASES):
        payload = bytearray()
        for _ in range(rng.randrange(4)):
            kind = rng.choice((*NEED, rng.randrange(256)))
            size = max(0, NEED.get(kind, 2) + rng.choice((0, 0, 0, 1, -1)))
            payload += bytes([kind, size]) + rng.randbytes(size)
        if payload and rng.randrange(3) == 0:
            payload[rng.randrange(len(payload))] = rng.randrange(256)
        where = f"seed {SEED} case {case}: {payload.hex()}"
        try:
            found = parse_records(bytes(payload))
        except PduError as error:
            reason = error.reason
        except Exception as error:
            raise AssertionError(where) from error
        else:
            assert parse_records(build_records(found)) == found, where
            reason = None
            parsed += bool(found)
        assert reason in (None, "rx_control_bad"), where
    assert CASES // 4 < parsed < CASES * 3 // 4


@pytest.mark.parametrize(
    "record",
    [
        Stamp(-1, 0, 0),
        Stamp(256, 0, 0),
        Stamp(0, 256, 0),
        Stamp(0, 0, -1),
        Stamp(0, 0, MAX_AGE_US + 1),
        Beacon(65536, 0),
        Beacon(0, 65536),
        Beacon(0, 0, 1 << 32),
        Need(256, 0, bytes(1)),
        Bare(256, bytes(1)),
        Bare(0, b""),
        Bare(0, bytes(17)),
        Want(256, 0, 0, 0, 0, 0),
        Want(0, 4, 0, 0, 0, 0),
        Want(0, 0, 128, 0, 0, 0),
        Want(0, 0, 0, -1, 0, 0),
        Want(0, 0, 0, 0, 256, 0),
        Grant(256, 0, 0),
        Grant(0, 256, 0),
        Grant(0, 0, -1),
        Grant(0, 0, 0, ((256, 0),)),
        Grant(0, 0, 0, ((0, 0),) * 125),
        Flows(256, 0),
        Flows(0, 1 << 16),
        Flows(0, 0, (ReservedFlow(256, 0, 0, 0, 0, 0, 0),)),
        Flows(0, 0, (ReservedFlow(0, 0, 4, 0, 0, 0, 0),)),
        Flows(0, 0, (ReservedFlow(0, 0, 0, 128, 0, 0, 0),)),
        Flows(0, 0, (ReservedFlow(0, 0, 0, 0, 1 << 16, 0, 0),)),
        Flows(0, 0, (ReservedFlow(0, 0, 0, 0, 0, 1 << 32, 0),)),
        Flows(0, 0, (ReservedFlow(0, 0, 0, 0, 0, 0, 0),) * 19),
        Admit(256, 0, 0),
        Admit(0, 1 << 16, 0),
        Admit(0, 0, 256),
        Admit(0, 0, 0, bytes(200), bytes(60)),
        Lsa(256, 0),
        Lsa(0, 1 << 16),
        Lsa(0, 0, ((256, 0),)),
        Lsa(0, 0, ((0, 0),) * 127),
        Route(256, 0, 0, b""),
        Route(0, 0, 1 << 32, b""),
        Route(0, 0, 0, bytes(250)),
        Need(0, 1 << 32, bytes(1)),
        Need(0, 0, b""),
        Need(0, 0, bytes(17)),
        Repeat(0, 0, 65536, 0),
        Repeat(0, 0, 0, 256),
        LinkReport(256, 0, 0, 0),
        LinkReport(0, -129, 0, 0),
        LinkReport(0, 128, 0, 0),
        LinkReport(0, 0, 256, 0),
        LinkReport(0, 0, 0, 256),
        Receipt(256, 0, 0),
        Receipt(0, 256, 0),
        Parity(0, 0, 256, 0, 0, 0, 0, 0, b""),
        Parity(0, 0, 0, 0, 0, 0, 0, 0, bytes(243)),
        Receipt(0, 0, 256),
        Receipt(0, 0, 0, 256, 0),
        Receipt(0, 0, 0, 0, NO_AGE + 1),
        Receipt(0, 0, 0, 0, 0, 65536),
        Waits(0, 0, 0, 256),
        Clock(65536, 0, 0, 0),
        Clock(0, 65536, 0, 0),
        Clock(0, 0, 65536, 0),
        Clock(0, 0, 0, -1),
        Clock(0, 0, 0, 0, 1 << 63),
        Clock(0, 0, 0, 0, 0, 65536),
        Clock(0, 0, 0, 0, arrivals=(Arrival(0, 0, 10 << 31),)),
        Clock(0, 0, 0, 0, arrivals=(Arrival(0, 0, 0),) * (MAX_ARRIVALS + 1)),
        Frame(256, 0, 0, 0),
        Frame(0, 256, 0, 0),
        Frame(0, -1, 0, 0),
        Frame(0, 0, 0x10000, 0),
        Frame(0, 0, 0, MAX_AGE_US + 1),
        RegistryDigest(bytes(8), bytes(248)),
        Contact(bytes(7)),
        Contact(bytes(8), (Met(256, bytes(4), 0),)),
        Contact(bytes(8), (Met(0, bytes(4), 1 << 31),)),
        Contact(bytes(8), (Met(0, bytes(4), 0),) * 28),
        KeyTold(4, False, bytes(4)),
        KeyTold(-1, False, bytes(4)),
        TopicPiece(256, 0, 0, 1, b""),
        TopicPiece(16, 1 << 16, 0, 1, b""),
        *(TopicPiece(16, 0, at, n, b"") for at, n in ((-1, 0), (16, 0), (0, -1), (0, 16))),
        TopicPiece(16, 0, 0, 1, bytes(252)),
        Want(0, -1, 0, 0, 0, 0),
        Want(0, 0, -1, 0, 0, 0),
        Want(0, 0, 0, 128, 0, 0),
        Want(0, 0, 0, 0, 0, 256),
        Flows(0, 0, (ReservedFlow(0, 0, -1, 0, 0, 0, 0),)),
        Flows(0, 0, (ReservedFlow(0, 0, 0, -1, 0, 0, 0),)),
        Wanted(256, b""),
        Wanted(0, bytes(255)),
        KeyTold(0, False, bytes(3)),
        LostNumbers(4, bytes(4), bytes(8)),
        LostNumbers(0, bytes(3), bytes(8)),
        LostNumbers(0, bytes(4), bytes(7)),
        RatesAsked(256, ()),
        RatesAsked(0, ((256, 0),)),
        RatesAsked(0, ((0, 0),) * 128),
        FoundNumbers(256, bytes(8), 0, 0, None),
        FoundNumbers(0, bytes(9), 0, 0, None),
        FoundNumbers(0, bytes(8), 4, 0, None),
        FoundNumbers(0, bytes(8), 0, 1 << 30, None),
        FoundNumbers(0, bytes(8), 0, -1, None),
        FoundNumbers(0, bytes(8), 0, 0, (1 << 32) - 1),
        FoundNumbers(0, bytes(8), 0, 0, -1),
    ],
    ids=str,
)
def test_field_out_of_range(record):
    with pytest.raises(ValueError):
        build_records([record])


def test_the_largest_values_fit():
    for record in (Wanted(0, bytes(254)), TopicPiece(16, 0, 0, 1, bytes(251))):
        assert parse_records(build_records([record])) == [record]


@pytest.mark.parametrize("sign", [1, -1])
def test_times_of_arrivals_are_told_in_tens_of_nanoseconds_if_they_fit(sign):
    most = 10 * ((1 << 31) - 1)
    for after_ns, told_ns in ((14, 10), (16, 20), (most, most)):
        arrival = Arrival(1, 2, sign * after_ns)
        assert tellable(arrival)
        (clock,) = parse_records(build_records([Clock(1, 2, 3, 4, arrivals=(arrival,))]))
        assert clock.arrivals == (Arrival(1, 2, sign * told_ns),)
    assert not tellable(Arrival(1, 2, sign * (most + 1)))


def refused(payload):
    with pytest.raises(PduError) as error:
        parse_records(payload)
    assert error.value.reason == "rx_control_bad"


@pytest.mark.parametrize("size", [0, 4, 7, 9])
def test_digest_of_another_length(size):
    with pytest.raises(ValueError, match="digest"):
        build_records([RegistryDigest(bytes(size), b"")])


def test_periods_are_told_in_eighths_of_an_octave():
    """By the table of the wire document: 80 is 1 s, and 8 more are twice as long."""
    for seconds, code in ((1.0, 80), (2.0, 88), (0.5, 72), (0.1, 53), (1e-6, 0), (1e9, 255)):
        assert period_code(seconds) == code
    for code in range(256):
        assert period_code(period_s(code)) == code
        assert period_code(1.05 * period_s(code)) == code
    for wrong in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="a period of"):
            period_code(wrong)
    record = RatesAsked(2, ((16, 72), (17, 80)))
    assert build_records([record]) == bytes.fromhex("1d05 02 1048 1150")
    assert parse_records(bytes.fromhex("1d06 02 1048 1150 ff")) == [record]


def test_golden_records_about_lost_numbers():
    """Octets by hand, from the tables of the wire document."""
    number = bytes(range(8))
    for record, octets in (
        (LostNumbers(2, bytes.fromhex("c0ffee11"), number), "1b0d 02 c0ffee11 0001020304050607"),
        (
            FoundNumbers(7, number, 2, 100_000, 86_400 * 32),
            "1c11 07 0001020304050607 800186a0 002a3000",
        ),
        (FoundNumbers(7, number, 0, 0, None), "1c11 07 0001020304050607 00000000 ffffffff"),
    ):
        assert build_records([record]) == bytes.fromhex(octets)
        assert parse_records(bytes.fromhex(octets)) == [record]
