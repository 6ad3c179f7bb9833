"""Declared topics and parts of large messages: what is told arrives, nonsense is refused."""

from hashlib import sha256

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import PduError
from sdrlinkd.wire import (
    PARTS,
    ControlEntries,
    Description,
    Entry,
    Parity,
    Part,
    Pdu,
    Stamp,
    build_part,
    build_records,
    max_large_size,
    max_size,
    numbered,
    octet,
    overhead,
    parse_description,
    parse_part,
    part_size,
    pieces,
    read_control_entries,
    with_topic,
)
from tests.laws import law

octets = st.integers(0, 255)
topic_ids = st.sampled_from([0, 13, 16, 255])
names = st.tuples(st.sampled_from(["odom", "_x/Y2/z", "camera/image"]), st.integers(0, 40)).map(
    lambda parts: parts[0] + "x" * parts[1]
)
SHORT = Description("a", "p/msg/N")


def joined(told):
    return b"".join(piece.data for piece in told)


@law(100)
@given(
    names, names, st.binary(min_size=8, max_size=8), st.integers(0, 300), st.booleans(),
    st.integers(8, 60), octets,
)  # fmt: skip
def test_a_description_arrives_in_pieces(name, kind, hash_, depth, is_best_effort, room, number):
    kind = kind.replace("/", "_")
    about = Description(name, f"pkg/msg/X{kind}", hash_, depth, is_best_effort)
    size = 10 + len(about.name) + 1 + len(about.type)
    if size > 15 * room:
        with pytest.raises(ValueError, match=f"{size} octets in pieces of {room}"):
            pieces(number, about, room)
        return
    told = pieces(number, about, room)
    n = -(-size // room)
    assert [each[0] for each in told] == [number] * n
    assert [each[2:4] for each in told] == [(i, n) for i in range(n)]
    assert [len(each.data) for each in told[:-1]] == [room] * (n - 1)
    (check,) = {each.check for each in told}
    found = parse_description(joined(told), check)
    assert found == about._replace(depth=min(depth, 255))


def test_a_description_in_no_room_or_one_octet_each_does_not_fit():
    for room in (0, 1):
        with pytest.raises(ValueError, match="19 octets"):
            pieces(16, SHORT, room)


@pytest.mark.parametrize(
    ("about", "expected"),
    [
        (SHORT._replace(name="/a", type="p/N"), SHORT),
        (SHORT._replace(name="a" * 128), None),
        (SHORT._replace(name="a" * 129), "is no topic name"),
        (SHORT._replace(name="a-b"), "is no topic name"),
        (SHORT._replace(type="p/msg/" + "N" * 122), None),
        (SHORT._replace(type="p/msg/" + "N" * 123), "is no message type"),
        (SHORT._replace(type="p.N"), "is no message type"),
    ],
)
def test_what_a_description_may_say(about, expected):
    told = pieces(16, about, 40)
    if isinstance(expected, str):
        with pytest.raises(PduError, match=expected) as refused:
            parse_description(joined(told), told[0].check)
        assert refused.value.reason == "rx_control_bad"
    else:
        assert parse_description(joined(told), told[0].check) == (expected or about)


def test_a_depth_is_told_up_to_255():
    for depth in (254, 255, 256, 300):
        (told,) = pieces(16, SHORT._replace(depth=depth), 200)
        assert parse_description(told.data, told.check).depth == min(depth, 255)


def test_the_depth_of_what_is_not_latched_does_not_count_and_pieces_must_fit_together():
    (told,) = pieces(16, SHORT, 200)
    for flags, depth, is_best_effort, kept in (
        (0, 7, False, 0), (2, 7, True, 0), (1, 0, False, 1), (3, 9, True, 9),
    ):  # fmt: skip
        changed = bytes([flags, depth]) + told.data[2:]
        with pytest.raises(PduError, match="do not belong together"):
            parse_description(changed, told.check)
        found = parse_description(changed, check_of(changed))
        assert (found.depth, found.is_best_effort) == (kept, is_best_effort)
    with pytest.raises(PduError, match="do not belong together"):
        parse_description(told.data[:9], check_of(told.data[:9]))
    with pytest.raises(PduError, match="is no topic name"):
        parse_description(told.data[:10], check_of(told.data[:10]))


def check_of(joined):
    return int.from_bytes(sha256(joined).digest()[:2], "big")


def test_sizes_with_the_octet_that_stands_ahead():
    """255 fragments carry a message; those of a part have at least a tenth of parity."""
    assert [overhead(each) for each in (0, 15, 16, 255, PARTS)] == [0, 0, 1, 1, 1]
    assert [octet(each) for each in (0, 15, 16, 255, PARTS)] == [0, 15, 16, 255, 14]
    assert (max_size(64, 15), max_size(64, 16)) == (255 * 51, 255 * 50)
    for share, fragments in ((0.0, 232), (0.1, 232), (0.5, 170), (1.0, 128)):
        assert part_size(64, share) == fragments * 50 - 5
        assert max_large_size(64, share) == 255 * part_size(64, share)
    assert part_size(64) == part_size(64, 0.1)
    assert max_large_size(64) == max_large_size(64, 0.1)


@law(60)
@given(topic_ids, st.integers(0, 0xFFFF), octets, octets, st.binary(max_size=20))
def test_a_part_is_one_of_its_message_and_holds_something(topic_id, number, at, n, data):
    part = Part(topic_id, number, at, n, data)
    found = parse_part(build_part(part))
    assert found == (part if at < n and data else None)
    assert parse_part(build_part(part._replace(topic_id=14 + at % 2))) is None


@pytest.mark.parametrize("change", [{"topic_id": 256}, {"number": 1 << 16}, {"parts": 256}])
def test_a_part_with_a_field_out_of_range(change):
    with pytest.raises(ValueError, match="does not fit a part"):
        build_part(Part(0, 0, 0, 1, b"x")._replace(**change))


def pdu(*entries):
    return Pdu(0, False, 1, 255, 0, 1, list(entries))


def test_the_first_octet_under_topic_id_14_says_which_topic_it_is():
    plain, control = Entry(3, 0, 0, 1, b"abc"), Entry(15, 0, 0, 1, b"")
    assert numbered(pdu(plain, control)) == pdu(plain, control)
    told = {
        b"\0ab": (PARTS, b"ab"), b"\x10": (16, b""), b"\xffcd": (255, b"cd"),
        b"\x0fab": None, b"\x01": None, b"": None,
    }  # fmt: skip
    for payload, expected in told.items():
        entry = Entry(14, 5, 1, 3, payload)
        meant = [] if expected is None else [Entry(expected[0], 5, 1, 3, expected[1])]
        assert numbered(pdu(plain, entry, control)) == pdu(plain, *meant, control), payload


def test_in_records_topic_14_means_parts():
    parity = Parity(14, 1, 2, 3, 4, 5, 6, 7, b"")
    assert with_topic(Stamp(14, 1, 2)) == Stamp(PARTS, 1, 2)
    assert with_topic(parity) == parity._replace(topic_id=PARTS)
    for record in (Stamp(13, 1, 2), parity._replace(topic_id=15), SHORT):
        assert with_topic(record) == record


def test_unreadable_control_entries_are_counted_and_the_others_used():
    good = [build_records([Stamp(i, 1, 2)]) for i in range(3)]
    entries = [
        Entry(15, 0, 0, 1, good[0]),
        Entry(4, 0, 0, 1, good[1]),
        Entry(15, 0, 0, 2, good[1]),
        Entry(15, 0, 0, 1, good[1] + b"\1"),
        Entry(15, 0, 0, 1, good[2]),
    ]
    records = [Stamp(0, 1, 2), Stamp(2, 1, 2)]
    assert read_control_entries(pdu(*entries)) == ControlEntries(records, 4, 2)
    assert read_control_entries(pdu(entries[1])) == ControlEntries([], 0, 0)
