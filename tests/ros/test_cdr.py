"""Octets against their type: what the bridge hands to DDS, an independent library can read."""

import struct
from random import Random

import numpy as np
import pytest
from sdrlink_ros import cdr

from sdrlinkd.adapters import empty, from_cdr, to_cdr
from sdrlinkd.errors import CdrError
from tests.ros.types import TYPES, fields_of, made

FLAT = "sensor_msgs/msg/Image", "sensor_msgs/msg/LaserScan", "nav_msgs/msg/OccupancyGrid"
KINDS = sorted(each for each in TYPES.fielddefs if "/msg/" in each)
LITTLE = bytes((0, 1, 0, 0))


def fits_of(kind):
    package, _, last = kind.split("/")
    return cdr.fits(fields_of(f"{package}/{last}"), fields_of)


def assert_readable(octets, kind):
    try:
        from_cdr(octets, kind)
    except CdrError as error:
        # Some microcontrollers send an empty text without its NUL, and most middleware takes it.
        assert "Invalid string length 0" in str(error)  # noqa: PT017


@pytest.mark.slow
def test_messages_fit_and_what_fits_can_be_read():
    """All types of ROS 2 Humble, filled at random, in both orders; shortened, and with changes."""
    chance = Random(10)
    refused = passed = 0
    assert len(KINDS) > 100
    for kind in KINDS:
        fits = fits_of(kind)
        for message in (empty(kind), made(kind, chance), made(kind, chance)):
            little = to_cdr(message, kind)
            big = bytes(TYPES.serialize_cdr(message, kind, little_endian=False))
            for whole in (little, big):
                assert fits(whole), kind
                assert fits(whole + bytes(3)), (kind, "padding")
                assert not fits(whole + bytes(4)), kind
                assert not fits(b"\0\3" + whole[2:]), (kind, "encapsulation")
                assert not fits(whole[:-1]), kind
            for _ in range(10):
                changed = bytearray(little)
                at = chance.randrange(4, len(little))
                changed[at : at + 4] = chance.choice(
                    [b"\xff\xff\xff\xff", b"\0\0\0\1", b"\1\0\0\0", chance.randbytes(4)]
                )
                is_good = fits(bytes(changed))
                passed, refused = passed + is_good, refused + (not is_good)
                if is_good:
                    assert_readable(bytes(changed), kind)
    assert refused > 1000
    assert passed > 2000


def test_lengths_texts_and_truths_that_cannot_be():
    of = {}.__getitem__
    u4 = struct.Struct("<I").pack
    for fields, body, is_good in (
        ({"a": "string"}, u4(3) + b"ab\0", True),
        ({"a": "string"}, u4(0), True),
        ({"a": "string"}, u4(3) + b"abc", False),
        ({"a": "string"}, u4(3) + b"\xff\xfe\0", False),
        ({"a": "string"}, u4(0xFFFFFFFF) + b"ab\0", False),
        ({"a": "string<2>"}, u4(3) + b"ab\0", True),
        ({"a": "string<2>"}, u4(4) + b"abc\0", False),
        ({"a": "boolean"}, b"\1", True),
        ({"a": "boolean"}, b"\2", False),
        ({"a": "boolean"}, b"", False),
        ({"a": "sequence<boolean>"}, u4(2) + b"\1\2", False),
        ({"a": "sequence<double>"}, u4(1) + bytes(4 + 8), True),
        ({"a": "sequence<double>"}, u4(1) + bytes(8), False),
        ({"a": "sequence<double>"}, u4(0x20000000) + bytes(4 + 8), False),
        ({"a": "sequence<uint8, 2>"}, u4(2) + b"ab", True),
        ({"a": "sequence<uint8, 2>"}, u4(3) + b"abc", False),
        ({"a": "sequence<string<1>, 1>"}, u4(1) + u4(2) + b"a\0", True),
        ({"a": "uint16[3]", "b": "uint8"}, bytes(7), True),
        ({"a": "uint16[3]", "b": "uint8"}, bytes(6), False),
        ({"a": "string[2]"}, u4(1) + bytes(4) + u4(1) + b"\0", True),
        ({"a": "wstring"}, u4(2) + bytes(8), True),
        ({"a": "wstring"}, u4(20) + bytes(40), True),
        ({"a": "wstring"}, u4(20) + bytes(30), False),
        ({}, b"\0", True),
        ({}, b"", False),
    ):
        assert cdr.fits(fields, of)(LITTLE + body) is is_good, (fields, body)
    for octets in (b"", b"\0", b"\0\1", b"\0\1\0"):
        assert not cdr.fits({"a": "uint8"}, of)(octets)


@pytest.mark.parametrize("n", [0, 1, 2, 3, 7, 8, 9, 100])
def test_rows_of_parts_end_where_each_of_them_does(n):
    """All alignments that fields can have, counted one by one."""
    for fields in (
        {"a": "uint8"}, {"a": "uint16", "b": "uint8"}, {"a": "uint8", "b": "double"},
        {"a": "double", "b": "uint8"}, {"a": "uint32", "b": "uint16"}, {"a": "uint8[3]"},
        {"a": "uint8", "b": "uint16", "c": "uint8", "d": "uint32", "e": "uint8"},
    ):  # fmt: skip
        sizes = {"uint8": 1, "uint16": 2, "uint32": 4, "double": 8}
        for begin in range(5):
            at = 4 + begin + -(4 + begin) % 4 + 4
            for _ in range(n):
                for each in fields.values():
                    size, times = (1, 3) if each == "uint8[3]" else (sizes[each], 1)
                    at += -at % size + size * times
            body = bytearray(at)
            body[:4] = struct.pack("<I", begin)
            count = 4 + begin + -(4 + begin) % 4
            body[count : count + 4] = struct.pack("<I", n)
            fits = cdr.fits({"x": "sequence<uint8>", "y": "sequence<t/S>"}, {"t/S": fields}.get)
            assert fits(LITTLE + bytes(body)), (fields, begin)
            assert not fits(LITTLE + bytes(body[:-1])), (fields, begin)
            assert not fits(LITTLE + bytes(body) + bytes(4)), (fields, begin)


def test_a_message_of_too_many_parts_is_not_looked_at(monkeypatch):
    monkeypatch.setattr(cdr, "MOST_PARTS", 100)
    fits = cdr.fits({"a": "sequence<string>"}, {}.get)
    for n, is_good in ((100, True), (101, False)):
        assert fits(LITTLE + struct.pack("<I", n) + bytes(4 * n)) is is_good


def test_large_flat_messages_have_few_parts(monkeypatch):
    """So what they take does not grow with their size."""
    monkeypatch.setattr(cdr, "MOST_PARTS", 12)
    image, scan, grid = map(empty, FLAT)
    image.data = np.zeros(65_000, np.uint8)
    scan.ranges = np.zeros(16_000, np.float32)
    grid.data = np.zeros(65_000, np.int8)
    for kind, message in zip(FLAT, (image, scan, grid), strict=True):
        assert fits_of(kind)(to_cdr(message, kind))
