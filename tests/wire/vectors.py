"""Golden vectors of the wire format, version 0.

Nothing of sdrlinkd is imported here. The octets are written out by hand from
sdrlinkd/wire/README.md, and the CRC is the shift register of clause 5.2. Which clause gives
which octet:

    octet 0      3.1  V in bits 7-4, Q in bits 3-2 (00 default, 01 latency, 10 bulk, 11 urgent),
                      C and E in bits 1 and 0: default 00, latency 04, bulk 08, urgent 0C
    octets 1-3   3.2  src, dst, seq
    octet 4      3.2  hop in the high nibble, N in the low nibble
    topic ids    3.3  the high nibble first; N odd leaves the last low nibble 0
    entry        4.1  entry id, index, total, length (2 octets, big endian), payload
    PAD          2    zeros: pdu_size - (7 + ceil(N/2)) - the sum of (5 + k)
    CRC          5.2  over all octets before it, big endian (clause 0)
    records      6    type, length, value, in an entry of topic id F that is index 0 of 1
    digest       7.2  SHA-256 of the lines; `printf '0,scan,sensor_msgs/msg/LaserScan\\n...' |
                      sha256sum` gave the literals
"""

from typing import NamedTuple

DEFAULT, LATENCY, BULK, URGENT = 0b00, 0b01, 0b10, 0b11
EVERYONE = 0xFF
CONTROL = 0xF


def crc16_xmodem(octets: bytes) -> int:
    """CRC-16/XMODEM, bit by bit (clause 5.2)."""
    register = 0x0000
    for octet in octets:
        register ^= octet << 8
        for _ in range(8):
            carry = register & 0x8000
            register = (register << 1) & 0xFFFF
            if carry:
                register ^= 0x1021
    return register


def with_crc(body: bytes) -> bytes:
    """The octets of a PDU, from all but its CRC."""
    crc = crc16_xmodem(body)
    return body + bytes([crc >> 8, crc & 0xFF])


def reseal(pdu: bytes) -> bytes:
    """The same PDU with a correct CRC."""
    return with_crc(pdu[:-2])


CRC_CHECK = (b"123456789", 0x31C3)


class EntryFields(NamedTuple):
    topic_id: int
    entry_id: int
    index: int
    total: int
    payload: bytes


class PduVector(NamedTuple):
    name: str
    pdu_size: int
    qos: int
    src: int
    dst: int
    seq: int
    hop: int
    entries: tuple[EntryFields, ...]
    octets: bytes


class RecordsVector(NamedTuple):
    """A control payload; each record is its name and its fields in the order of clause 6."""

    name: str
    payload: bytes
    records: tuple[tuple[str, tuple[object, ...]], ...]


class DigestVector(NamedTuple):
    name: str
    csv: str
    lines: tuple[str, ...]
    digest: bytes
    per_topic: bytes


class RefusalVector(NamedTuple):
    """Octets that clause 5.1 refuses. Only the named check rejects them."""

    name: str
    reason: str
    pdu_size: int
    octets: bytes


# CDR little endian header, then "hi".
HI = bytes([0x00, 0x01, 0x00, 0x00, 0x68, 0x69])
RAMP_19 = bytes(range(0x80, 0x93))
UP_101 = bytes(range(101))
DOWN_101 = bytes(range(255, 154, -1))

_single = PduVector(
    "single",
    32, DEFAULT, 1, EVERYONE, 0, 1,
    (EntryFields(1, 0x2A, 0, 1, HI),),
    with_crc(bytes([
        0x00, 1, 0xFF, 0, 0x11,
        0x10,
        0x2A, 0, 1, 0x00, 0x06, 0x00, 0x01, 0x00, 0x00, 0x68, 0x69,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  # 32 - 8 - 11 = 13
    ])),
)  # fmt: skip

_single_full = PduVector(
    "single_full",
    32, BULK, 0, 7, 255, 15,
    (EntryFields(4, 0x00, 254, 255, RAMP_19),),
    with_crc(bytes([
        0x08, 0, 7, 255, 0xF1,
        0x40,
        0x00, 254, 255, 0x00, 0x13,
        0x80, 0x81, 0x82, 0x83, 0x84, 0x85, 0x86, 0x87, 0x88, 0x89,
        0x8A, 0x8B, 0x8C, 0x8D, 0x8E, 0x8F, 0x90, 0x91, 0x92,
    ])),  # k*(1) = 32 - 13 = 19, no PAD
)  # fmt: skip

_empty = PduVector(
    "empty_message",
    32, LATENCY, 255, EVERYONE, 128, 2,
    (EntryFields(0, 0xFF, 0, 1, b""),),
    with_crc(bytes([
        0x04, 255, 0xFF, 128, 0x21,
        0x00,
        0xFF, 0, 1, 0x00, 0x00,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  # 32 - 8 - 5 = 19
    ])),
)  # fmt: skip

_urgent = PduVector(
    "urgent",
    32, URGENT, 9, 3, 0x7F, 15,
    (EntryFields(3, 0x10, 0, 2, b"\x00\x01"),),
    with_crc(bytes([
        0x0C, 9, 3, 0x7F, 0xF1,
        0x30,
        0x10, 0, 2, 0x00, 0x02, 0x00, 0x01,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  # 32 - 8 - 7 = 17
    ])),
)  # fmt: skip

_two_101 = PduVector(
    "two_of_101",
    220, DEFAULT, 2, EVERYONE, 0x33, 1,
    (EntryFields(0, 0xA1, 0, 4, UP_101), EntryFields(1, 0xB2, 6, 7, DOWN_101)),
    with_crc(
        bytes([0x00, 2, 0xFF, 0x33, 0x12, 0x01])
        + bytes([0xA1, 0, 4, 0x00, 0x65]) + UP_101
        + bytes([0xB2, 6, 7, 0x00, 0x65]) + DOWN_101
    ),  # 220 - 8 - 2 * 106 = 0
)  # fmt: skip

_two_padded = PduVector(
    "two_padded",
    220, LATENCY, 2, EVERYONE, 0x34, 1,
    (EntryFields(0, 0xA1, 1, 4, UP_101), EntryFields(0, 0xA1, 2, 4, UP_101[:99])),
    with_crc(
        bytes([0x04, 2, 0xFF, 0x34, 0x12, 0x00])
        + bytes([0xA1, 1, 4, 0x00, 0x65]) + UP_101
        + bytes([0xA1, 2, 4, 0x00, 0x63]) + UP_101[:99]
        + bytes([0, 0])
    ),  # 220 - 8 - 106 - 104 = 2
)  # fmt: skip

_three = PduVector(
    "three_odd_nibble",
    48, BULK, 17, 18, 200, 3,
    (
        EntryFields(5, 0x01, 0, 3, b"\xDE\xAD"),
        EntryFields(14, 0x02, 1, 3, b""),
        EntryFields(10, 0x03, 2, 3, b"\xBE\xEF\x00"),
    ),
    with_crc(bytes([
        0x08, 17, 18, 200, 0x33,
        0x5E, 0xA0,
        0x01, 0, 3, 0x00, 0x02, 0xDE, 0xAD,
        0x02, 1, 3, 0x00, 0x00,
        0x03, 2, 3, 0x00, 0x03, 0xBE, 0xEF, 0x00,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  # 48 - 9 - 7 - 5 - 8 = 19
    ])),
)  # fmt: skip

_fifteen = PduVector(
    "fifteen",
    110, DEFAULT, 1, EVERYONE, 1, 1,
    (
        EntryFields(0, 0xE0, 0, 1, b"a"),
        EntryFields(1, 0xE1, 0, 1, b"b"),
        EntryFields(2, 0xE2, 0, 1, b"c"),
        EntryFields(3, 0xE3, 0, 1, b"d"),
        EntryFields(4, 0xE4, 0, 1, b"e"),
        EntryFields(5, 0xE5, 0, 1, b"f"),
        EntryFields(6, 0xE6, 0, 1, b"g"),
        EntryFields(7, 0xE7, 0, 1, b"h"),
        EntryFields(8, 0xE8, 0, 1, b"i"),
        EntryFields(9, 0xE9, 0, 1, b"j"),
        EntryFields(10, 0xEA, 0, 1, b"k"),
        EntryFields(11, 0xEB, 0, 1, b"l"),
        EntryFields(12, 0xEC, 0, 1, b"m"),
        EntryFields(13, 0xED, 0, 1, b"n"),
        EntryFields(14, 0xEE, 0, 1, b"o"),
    ),
    with_crc(bytes([
        0x00, 1, 0xFF, 1, 0x1F,
        0x01, 0x23, 0x45, 0x67, 0x89, 0xAB, 0xCD, 0xE0,
        0xE0, 0, 1, 0, 1, 0x61,
        0xE1, 0, 1, 0, 1, 0x62,
        0xE2, 0, 1, 0, 1, 0x63,
        0xE3, 0, 1, 0, 1, 0x64,
        0xE4, 0, 1, 0, 1, 0x65,
        0xE5, 0, 1, 0, 1, 0x66,
        0xE6, 0, 1, 0, 1, 0x67,
        0xE7, 0, 1, 0, 1, 0x68,
        0xE8, 0, 1, 0, 1, 0x69,
        0xE9, 0, 1, 0, 1, 0x6A,
        0xEA, 0, 1, 0, 1, 0x6B,
        0xEB, 0, 1, 0, 1, 0x6C,
        0xEC, 0, 1, 0, 1, 0x6D,
        0xED, 0, 1, 0, 1, 0x6E,
        0xEE, 0, 1, 0, 1, 0x6F,
        0, 0, 0, 0, 0,  # 110 - 15 - 15 * 6 = 5
    ])),
)  # fmt: skip

_long_length = PduVector(
    "length_of_two_octets",
    2047, BULK, 4, EVERYONE, 4, 1,
    (EntryFields(4, 0x77, 0, 255, bytes([0x5A]) * 2034),),
    with_crc(
        bytes([0x08, 4, 0xFF, 4, 0x11, 0x40])
        + bytes([0x77, 0, 255, 0x07, 0xF2]) + bytes([0x5A]) * 2034
    ),  # k*(1) = 2047 - 13 = 2034 = 0x07F2
)  # fmt: skip

# Clause 4.4: the number 42, then the fragment.
_numbered = PduVector(
    "numbered",
    32, DEFAULT, 1, EVERYONE, 5, 1,
    (EntryFields(14, 0x2A, 0, 1, bytes([42]) + HI),),
    with_crc(bytes([
        0x00, 1, 0xFF, 5, 0x11,
        0xE0,
        0x2A, 0, 1, 0x00, 0x07, 42, 0x00, 0x01, 0x00, 0x00, 0x68, 0x69,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  # 32 - 8 - 12 = 12
    ])),
)  # fmt: skip

# Number 0: part 1 of 2 of large message 0x0102 of topic 42, "hi" its end; then its STAMP, where 14
# stands for number 0: age 5 us.
_part = PduVector(
    "part",
    48, DEFAULT, 1, EVERYONE, 6, 1,
    (
        EntryFields(14, 0x2B, 0, 1, bytes([0, 42, 1, 2, 1, 2]) + b"hi"),
        EntryFields(15, 0x00, 0, 1, bytes([1, 6, 14, 0x2B, 0, 0, 0, 5])),
    ),
    with_crc(bytes([
        0x00, 1, 0xFF, 6, 0x12,
        0xEF,
        0x2B, 0, 1, 0x00, 0x08, 0, 42, 1, 2, 1, 2, 0x68, 0x69,
        0x00, 0, 1, 0x00, 0x08, 1, 6, 14, 0x2B, 0, 0, 0, 5,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  # 48 - 8 - 26 = 14
    ])),
)  # fmt: skip

# Table 4 of the paper.
TABLE_4 = DigestVector(
    "table_4",
    "scan,sensor_msgs/LaserScan\n"
    "odom,nav_msgs/Odometry\n"
    "imu,sensor_msgs/Imu\n"
    "cmd_vel,geometry_msgs/Twist\n"
    "map,nav_msgs/OccupancyGrid\n"
    "clock,rosgraph_msgs/Clock\n",
    (
        "0,scan,sensor_msgs/msg/LaserScan\n",
        "1,odom,nav_msgs/msg/Odometry\n",
        "2,imu,sensor_msgs/msg/Imu\n",
        "3,cmd_vel,geometry_msgs/msg/Twist\n",
        "4,map,nav_msgs/msg/OccupancyGrid\n",
        "5,clock,rosgraph_msgs/msg/Clock\n",
    ),
    bytes.fromhex("8c29071360508ee6"),
    bytes.fromhex("2f48269ab1a2"),
)
ONE_TOPIC = DigestVector(
    "one_topic",
    "scan,sensor_msgs/LaserScan\n",
    ("0,scan,sensor_msgs/msg/LaserScan\n",),
    bytes.fromhex("2f60916eeaa09f18"),
    bytes.fromhex("2f"),
)
DIGESTS = (TABLE_4, ONE_TOPIC)

# STAMP: topic 1, entry id 0x2A, 1 234 567 µs = 0x0012D687.
STAMP = RecordsVector(
    "stamp",
    bytes([1, 6, 1, 0x2A, 0x00, 0x12, 0xD6, 0x87]),
    (("STAMP", (1, 0x2A, 1_234_567)),),
)
# An age beyond 2**32 - 1 µs is sent as that.
STAMP_OLD = RecordsVector(
    "stamp_old",
    bytes([1, 6, 14, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF]),
    (("STAMP", (14, 0xFF, 4_294_967_295)),),
)
# BEACON: boot id 0xBEEF, number 513; DIGEST of Table 4: 8 + 6 octets.
BEACON_DIGEST = RecordsVector(
    "beacon_digest",
    bytes([2, 4, 0xBE, 0xEF, 0x02, 0x01, 3, 14, *TABLE_4.digest, *TABLE_4.per_topic]),
    (("BEACON", (0xBEEF, 513)), ("DIGEST", (TABLE_4.digest, TABLE_4.per_topic))),
)
# Node 6 is heard at -3.25 dB = -13 quarters = 0xF3, PER 51/255, and should use MCS 2.
LINK_REPORT = RecordsVector(
    "link_report",
    bytes([4, 4, 6, 0xF3, 51, 2]),
    (("LINK_REPORT", (6, -13, 51, 2)),),
)
RECEIPT = RecordsVector(
    "receipt",
    bytes([5, 3, 3, 0x99, 1]),
    (("RECEIPT", (3, 0x99, 1)),),
)
# FRAME: root 3, level 2, schedule 0xC0DE, 70 123 µs = 0x000111EB into the frame.
FRAME = RecordsVector(
    "frame",
    bytes([7, 8, 3, 2, 0xC0, 0xDE, 0x00, 0x01, 0x11, 0xEB]),
    (("FRAME", (3, 2, 0xC0DE, 70_123)),),
)
# The octet behind the age: a RECEIPT is wanted.
ASKING_STAMP = RecordsVector(
    "asking_stamp",
    bytes([1, 7, 3, 0x10, 0x00, 0x00, 0x00, 0x05, 1]),
    (("STAMP", (3, 0x10, 5, True)),),
)
# To robot 4, at an age of 12.3 ms, 25.7 ms ago.
FULL_RECEIPT = RecordsVector(
    "full_receipt",
    bytes([5, 8, 3, 0x99, 1, 4, 0, 123, 1, 1]),
    (("RECEIPT", (3, 0x99, 1, 4, 123, 257)),),
)
# Boot id 0xBEEF, number 0x0102; 0x0101 left at 2**32 + 1 ns; wall 2**40 ns, ± 300 µs = 0x012C.
# Robot 9's CLOCK 0x0102 came 1 µs before that: -100 * 10 ns = 0xFFFFFF9C.
CLOCK = RecordsVector(
    "clock",
    bytes([8, 31, 0xBE, 0xEF, 1, 2, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0])
    + bytes([0x01, 0x2C, 9, 1, 2, 0xFF, 0xFF, 0xFF, 0x9C]),
    (("CLOCK", (0xBEEF, 0x0102, 0x0101, 4_294_967_297, 1 << 40, 300, ((9, 0x0102, -1000),))),),
)
# Topic 42 = 0x2A is odom, latched (flag 1) with depth 5, hash 00 01 ... 07; piece 0 of 1.
# `sha256sum` of these octets begins with 61d2.
DESCRIPTION = bytes([1, 5, *range(8)]) + b"odom\0nav_msgs/msg/Odometry"
TOPIC_CHECK = 0x61D2
TOPIC = RecordsVector(
    "topic",
    bytes([15, 4 + len(DESCRIPTION), 42, 0x61, 0xD2, 0x01]) + DESCRIPTION,
    (("TOPIC", (42, TOPIC_CHECK, 0, 1, DESCRIPTION)),),
)
# The second of two pieces, from octet 14 on.
TOPIC_PIECE = RecordsVector(
    "topic_piece",
    bytes([15, 4 + len(DESCRIPTION) - 14, 42, 0x61, 0xD2, 0x12]) + DESCRIPTION[14:],
    (("TOPIC", (42, TOPIC_CHECK, 1, 2, DESCRIPTION[14:])),),
)
# Robot 1's topics 16 = 0x10, 17 and 255.
WANTED = RecordsVector(
    "wanted", bytes([17, 4, 1, 0x10, 0x11, 0xFF]), (("WANTED", (1, b"\x10\x11\xff")),)
)
WAITS = RecordsVector("waits", bytes([9, 4, 3, 255, 0, 7]), (("WAITS", (3, 255, 0, 7)),))
# PDU number 100 005 = 0x000186A5 behind the fields of BEACON.
BEACON_NUMBERED = RecordsVector(
    "beacon_numbered",
    bytes([2, 8, 0xBE, 0xEF, 0x02, 0x01, 0x00, 0x01, 0x86, 0xA5]),
    (("BEACON", (0xBEEF, 513, 100_005)),),
)
# Number 7 tells that 6 left at 1 s = 0x3B9ACA00 ns; wall 2**60 ns, ± 5 µs. Robot 9's 0x0102 came
# 2.5 µs later: 250 = 0xFA; robot 200's 0xFFFF came (2**31 - 1) * 10 ns later. PDU number 2**32 - 1.
# 24 + 2 * 7 + 4 = 42 octets.
CLOCK_NUMBERED = RecordsVector(
    "clock_numbered",
    bytes([8, 42, 0xBE, 0xEF, 0, 7, 0, 6, 0, 0, 0, 0, 0x3B, 0x9A, 0xCA, 0x00])
    + bytes([0x10, 0, 0, 0, 0, 0, 0, 0, 0, 5])
    + bytes([9, 0x01, 0x02, 0x00, 0x00, 0x00, 0xFA])
    + bytes([200, 0xFF, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF])
    + bytes([0xFF, 0xFF, 0xFF, 0xFF]),
    ((
        "CLOCK",
        (
            0xBEEF, 7, 6, 1_000_000_000, 1 << 60, 5,
            ((9, 0x0102, 2_500), (200, 0xFFFF, 21_474_836_470)),
            4_294_967_295,
        ),
    ),),
)  # fmt: skip
# None has left: stamped is the number itself. Wall not known: -2**63. No arrivals; PDU number 0.
CLOCK_FIRST = RecordsVector(
    "clock_first",
    bytes([8, 28, 0x00, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0])
    + bytes([0x80, 0, 0, 0, 0, 0, 0, 0, 0, 0])
    + bytes([0, 0, 0, 0]),
    (("CLOCK", (1, 0, 0, 0, -(1 << 63), 0, (), 0)),),
)
# 300 = 0x012C; bits 0, 2 and 7 from the top: 1010 0001.
NEED = RecordsVector(
    "need",
    bytes([10, 6, 3, 0x00, 0x00, 0x01, 0x2C, 0xA1]),
    (("NEED", (3, 300, b"\xa1")),),
)
NEED_NUMBERS = (300, 302, 307)
# Bits 0, 15, 16, 17, 67, 70 and 127 from the top; bit 16 stands for 2**32 = 0.
NEED_WIDE = RecordsVector(
    "need_wide",
    bytes([10, 21, 3, 0xFF, 0xFF, 0xFF, 0xF0])
    + bytes([0x80, 0x01, 0xC0, 0, 0, 0, 0, 0, 0x12, 0, 0, 0, 0, 0, 0, 0x01]),
    (("NEED", (3, 0xFFFFFFF0, b"\x80\x01\xc0" + bytes(5) + b"\x12" + bytes(6) + b"\x01")),),
)
NEED_WIDE_NUMBERS = (0xFFFFFFF0, 0xFFFFFFFF, 0, 1, 51, 54, 111)
# Robot 1 repeats 300 and 301, held for 123.4 ms = 1234 = 0x04D2.
REPEAT = RecordsVector(
    "repeat",
    bytes([18, 8, 1, 0x00, 0x00, 0x01, 0x2C, 0x04, 0xD2, 2]),
    (("REPEAT", (1, 300, 1234, 2)),),
)
RECORDS = (
    STAMP, STAMP_OLD, BEACON_DIGEST, LINK_REPORT, RECEIPT, FRAME,
    ASKING_STAMP, FULL_RECEIPT, CLOCK, WAITS, TOPIC, TOPIC_PIECE, WANTED,
    BEACON_NUMBERED, CLOCK_NUMBERED, CLOCK_FIRST, NEED, NEED_WIDE, REPEAT,
)  # fmt: skip

_stamped = PduVector(
    "message_and_stamp",
    32, LATENCY, 1, EVERYONE, 1, 1,
    (EntryFields(1, 0x2A, 0, 1, HI), EntryFields(CONTROL, 0, 0, 1, STAMP.payload)),
    with_crc(bytes([
        0x04, 1, 0xFF, 1, 0x12,
        0x1F,
        0x2A, 0, 1, 0x00, 0x06, 0x00, 0x01, 0x00, 0x00, 0x68, 0x69,
        0x00, 0, 1, 0x00, 0x08, 1, 6, 1, 0x2A, 0x00, 0x12, 0xD6, 0x87,
    ])),  # 32 - 8 - 11 - 13 = 0
)  # fmt: skip

_stamp_alone = PduVector(
    "stamp_alone",
    32, DEFAULT, 5, EVERYONE, 9, 1,
    (EntryFields(CONTROL, 0, 0, 1, STAMP_OLD.payload),),
    with_crc(bytes([
        0x00, 5, 0xFF, 9, 0x11,
        0xF0,
        0x00, 0, 1, 0x00, 0x08, 1, 6, 14, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  # 32 - 8 - 13 = 11
    ])),
)  # fmt: skip

_beacon = PduVector(
    "beacon_and_digest",
    64, DEFAULT, 5, EVERYONE, 10, 1,
    (EntryFields(CONTROL, 0, 0, 1, BEACON_DIGEST.payload),),
    with_crc(
        bytes([0x00, 5, 0xFF, 10, 0x11, 0xF0, 0x00, 0, 1, 0x00, 0x16])
        + bytes([2, 4, 0xBE, 0xEF, 0x02, 0x01])
        + bytes([3, 14]) + TABLE_4.digest + TABLE_4.per_topic
        + bytes(29)  # 64 - 8 - 27 = 29
    ),
)  # fmt: skip

_report = PduVector(
    "report_and_receipt",
    32, DEFAULT, 5, 6, 11, 1,
    (EntryFields(CONTROL, 0, 0, 1, LINK_REPORT.payload + RECEIPT.payload),),
    with_crc(bytes([
        0x00, 5, 6, 11, 0x11,
        0xF0,
        0x00, 0, 1, 0x00, 0x0B, 4, 4, 6, 0xF3, 51, 2, 5, 3, 3, 0x99, 1,
        0, 0, 0, 0, 0, 0, 0, 0,  # 32 - 8 - 16 = 8
    ])),
)  # fmt: skip

# What a PDU says about time: STAMP and FRAME.
_timed = PduVector(
    "message_stamp_and_frame",
    48, DEFAULT, 1, EVERYONE, 2, 1,
    (EntryFields(1, 0x2A, 0, 1, HI), EntryFields(CONTROL, 7, 0, 1, STAMP.payload + FRAME.payload)),
    with_crc(bytes([
        0x00, 1, 0xFF, 2, 0x12,
        0x1F,
        0x2A, 0, 1, 0x00, 0x06, 0x00, 0x01, 0x00, 0x00, 0x68, 0x69,
        0x07, 0, 1, 0x00, 0x12,
        1, 6, 1, 0x2A, 0x00, 0x12, 0xD6, 0x87,
        7, 8, 3, 2, 0xC0, 0xDE, 0x00, 0x01, 0x11, 0xEB,
        0, 0, 0, 0, 0, 0,  # 48 - 8 - 11 - 23 = 6
    ])),
)  # fmt: skip

# The same as it leaves 1 000 000 µs = 0x000F4240 later: 0x0012D687 + that = 0x002218C7,
# 0x000111EB + that = 0x0010542B.
_timed_later = _timed._replace(
    name="message_stamp_and_frame_a_second_later",
    entries=(
        EntryFields(1, 0x2A, 0, 1, HI),
        EntryFields(
            CONTROL, 7, 0, 1,
            bytes([1, 6, 1, 0x2A, 0x00, 0x22, 0x18, 0xC7])
            + bytes([7, 8, 3, 2, 0xC0, 0xDE, 0x00, 0x10, 0x54, 0x2B]),
        ),
    ),
    octets=with_crc(bytes([
        0x00, 1, 0xFF, 2, 0x12,
        0x1F,
        0x2A, 0, 1, 0x00, 0x06, 0x00, 0x01, 0x00, 0x00, 0x68, 0x69,
        0x07, 0, 1, 0x00, 0x12,
        1, 6, 1, 0x2A, 0x00, 0x22, 0x18, 0xC7,
        7, 8, 3, 2, 0xC0, 0xDE, 0x00, 0x10, 0x54, 0x2B,
        0, 0, 0, 0, 0, 0,
    ])),
)  # fmt: skip

# An unreadable control entry (clause 6), the message beside it, and a readable one.
_spoilt = PduVector(
    "message_and_spoilt_control",
    48, DEFAULT, 1, EVERYONE, 3, 1,
    (
        EntryFields(CONTROL, 5, 0, 1, bytes([5, 3, 1, 0x2A, 1, 4, 4, 6])),
        EntryFields(1, 0x2A, 0, 1, HI),
        EntryFields(CONTROL, 6, 0, 1, RECEIPT.payload),
    ),
    with_crc(bytes([
        0x00, 1, 0xFF, 3, 0x13,
        0xF1, 0xF0,
        0x05, 0, 1, 0x00, 0x08, 5, 3, 1, 0x2A, 1, 4, 4, 6,  # LINK_REPORT ends after 1 of 4
        0x2A, 0, 1, 0x00, 0x06, 0x00, 0x01, 0x00, 0x00, 0x68, 0x69,
        0x06, 0, 1, 0x00, 0x05, 5, 3, 3, 0x99, 1,
        0, 0, 0, 0, 0,  # 48 - 9 - 13 - 11 - 10 = 5
    ])),
)  # fmt: skip

# Seq is the lowest octet of the PDU number that the record tells.
_beacon_numbered = PduVector(
    "beacon_numbered",
    64, DEFAULT, 5, EVERYONE, 0xA5, 1,
    (
        EntryFields(
            CONTROL, 0, 0, 1,
            BEACON_NUMBERED.payload + bytes([3, 14, *TABLE_4.digest, *TABLE_4.per_topic]),
        ),
    ),
    with_crc(
        bytes([0x00, 5, 0xFF, 0xA5, 0x11, 0xF0, 0x00, 0, 1, 0x00, 0x1A])
        + bytes([2, 8, 0xBE, 0xEF, 0x02, 0x01, 0x00, 0x01, 0x86, 0xA5])
        + bytes([3, 14]) + TABLE_4.digest + TABLE_4.per_topic
        + bytes(25)  # 64 - 8 - 31 = 25
    ),
)  # fmt: skip

_clock_numbered = PduVector(
    "clock_numbered",
    64, DEFAULT, 1, EVERYONE, 0xFF, 1,
    (EntryFields(CONTROL, 0, 0, 1, CLOCK_NUMBERED.payload),),
    with_crc(bytes([
        0x00, 1, 0xFF, 0xFF, 0x11,
        0xF0,
        0x00, 0, 1, 0x00, 0x2C,
        8, 42, 0xBE, 0xEF, 0, 7, 0, 6, 0, 0, 0, 0, 0x3B, 0x9A, 0xCA, 0x00,
        0x10, 0, 0, 0, 0, 0, 0, 0, 0, 5,
        9, 0x01, 0x02, 0x00, 0x00, 0x00, 0xFA,
        200, 0xFF, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF,
        0xFF, 0xFF, 0xFF, 0xFF,
        0, 0, 0, 0, 0, 0, 0,  # 64 - 8 - 49 = 7
    ])),
)  # fmt: skip

_clock_and_need = PduVector(
    "clock_and_need",
    64, DEFAULT, 2, EVERYONE, 0, 1,
    (EntryFields(CONTROL, 0, 0, 1, CLOCK_FIRST.payload + NEED.payload),),
    with_crc(bytes([
        0x00, 2, 0xFF, 0, 0x11,
        0xF0,
        0x00, 0, 1, 0x00, 0x26,
        8, 28, 0x00, 0x01, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0x80, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        0, 0, 0, 0,
        10, 6, 3, 0x00, 0x00, 0x01, 0x2C, 0xA1,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  # 64 - 8 - 43 = 13
    ])),
)  # fmt: skip

# PDU 310 = 0x0136 announces 300 and 301, and asks robot 3 for some.
_need_and_repeat = PduVector(
    "need_and_repeat",
    64, DEFAULT, 1, EVERYONE, 0x36, 1,
    (EntryFields(CONTROL, 0, 0, 1, NEED_WIDE.payload + REPEAT.payload),),
    with_crc(bytes([
        0x00, 1, 0xFF, 0x36, 0x11,
        0xF0,
        0x00, 0, 1, 0x00, 0x21,
        10, 21, 3, 0xFF, 0xFF, 0xFF, 0xF0,
        0x80, 0x01, 0xC0, 0, 0, 0, 0, 0, 0x12, 0, 0, 0, 0, 0, 0, 0x01,
        18, 8, 1, 0x00, 0x00, 0x01, 0x2C, 0x04, 0xD2, 2,
        0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,  # 64 - 8 - 38 = 18
    ])),
)  # fmt: skip

_message_and_repeat = PduVector(
    "message_and_repeat",
    48, LATENCY, 1, EVERYONE, 0x36, 1,
    (EntryFields(1, 0x2A, 0, 1, HI), EntryFields(CONTROL, 0, 0, 1, STAMP.payload + REPEAT.payload)),
    with_crc(bytes([
        0x04, 1, 0xFF, 0x36, 0x12,
        0x1F,
        0x2A, 0, 1, 0x00, 0x06, 0x00, 0x01, 0x00, 0x00, 0x68, 0x69,
        0x00, 0, 1, 0x00, 0x12,
        1, 6, 1, 0x2A, 0x00, 0x12, 0xD6, 0x87,
        18, 8, 1, 0x00, 0x00, 0x01, 0x2C, 0x04, 0xD2, 2,
        0, 0, 0, 0, 0, 0,  # 48 - 8 - 11 - 23 = 6
    ])),
)  # fmt: skip

PDUS = (
    _single,
    _single_full,
    _empty,
    _urgent,
    _two_101,
    _two_padded,
    _three,
    _fifteen,
    _long_length,
    _numbered,
    _part,
    _stamped,
    _stamp_alone,
    _beacon,
    _report,
    _timed,
    _timed_later,
    _spoilt,
    _beacon_numbered,
    _clock_numbered,
    _clock_and_need,
    _need_and_repeat,
    _message_and_repeat,
)
BY_NAME = {vector.name: vector for vector in PDUS}

# The text of clause 10.
DOCUMENTED = {
    "numbered": (
        "00 01 ff 05 11 e0 2a 00 01 00 07 2a 00 01 00 00 "
        "68 69 00 00 00 00 00 00 00 00 00 00 00 00 ca 11"
    ),
    "part": (
        "00 01 ff 06 12 ef 2b 00 01 00 08 00 2a 01 02 01 "
        "02 68 69 00 00 01 00 08 01 06 0e 2b 00 00 00 05 "
        "00 00 00 00 00 00 00 00 00 00 00 00 00 00 16 9b"
    ),
    "single": (
        "00 01 ff 00 11 10 2a 00 01 00 06 00 01 00 00 68 "
        "69 00 00 00 00 00 00 00 00 00 00 00 00 00 4c d0"
    ),
    "message_and_stamp": (
        "04 01 ff 01 12 1f 2a 00 01 00 06 00 01 00 00 68 "
        "69 00 00 01 00 08 01 06 01 2a 00 12 d6 87 33 90"
    ),
    "report_and_receipt": (
        "00 05 06 0b 11 f0 00 00 01 00 0b 04 04 06 f3 33 "
        "02 05 03 03 99 01 00 00 00 00 00 00 00 00 02 af"
    ),
    "message_and_spoilt_control": (
        "00 01 ff 03 13 f1 f0 05 00 01 00 08 05 03 01 2a "
        "01 04 04 06 2a 00 01 00 06 00 01 00 00 68 69 06 "
        "00 01 00 05 05 03 03 99 01 00 00 00 00 00 97 d9"
    ),
}

_HEADER = bytes([0x00, 1, 0xFF, 0, 0x11])
_ENTRY = bytes([0x10, 0x2A, 0, 1, 0x00, 0x06]) + HI
REFUSALS = (
    RefusalVector("no octets", "rx_short", 32, b""),
    RefusalVector("an octet too few", "rx_short", 32, with_crc(_HEADER + _ENTRY + bytes(12))),
    RefusalVector("an octet too many", "rx_short", 32, with_crc(_HEADER + _ENTRY + bytes(14))),
    RefusalVector("CRC", "rx_crc", 32, _single.octets[:-1] + bytes([_single.octets[-1] ^ 1])),
    RefusalVector(
        "CRC in little endian", "rx_crc", 32, _single.octets[:-2] + _single.octets[:-3:-1]
    ),
    RefusalVector(
        "V = 1", "rx_version", 32, with_crc(bytes([0x10]) + _HEADER[1:] + _ENTRY + bytes(13))
    ),
    RefusalVector(
        "V = 8", "rx_version", 32, with_crc(bytes([0x80]) + _HEADER[1:] + _ENTRY + bytes(13))
    ),
    RefusalVector(
        "E = 1", "rx_flags", 32, with_crc(bytes([0x01]) + _HEADER[1:] + _ENTRY + bytes(13))
    ),
    RefusalVector("N = 0", "rx_entry", 32, with_crc(bytes([0x00, 1, 0xFF, 0, 0x10]) + bytes(25))),
    RefusalVector(
        "index = total",
        "rx_entry",
        32,
        with_crc(_HEADER + bytes([0x10, 0x2A, 1, 1, 0, 0]) + bytes(19)),
    ),
    RefusalVector(
        "total = 0",
        "rx_entry",
        32,
        with_crc(_HEADER + bytes([0x10, 0x2A, 0, 0, 0, 0]) + bytes(19)),
    ),
    RefusalVector(
        "the unused nibble",
        "rx_entry",
        32,
        with_crc(_HEADER + bytes([0x11]) + _ENTRY[1:] + bytes(13)),
    ),
    RefusalVector(
        "a payload into the CRC",
        "rx_entry",
        32,
        with_crc(_HEADER + bytes([0x10, 0x2A, 0, 1, 0, 20]) + bytes(19)),
    ),
    RefusalVector(
        "a length of 65535",
        "rx_entry",
        32,
        with_crc(_HEADER + bytes([0x10, 0x2A, 0, 1, 0xFF, 0xFF]) + bytes(19)),
    ),
    RefusalVector(
        "an entry header into the CRC",
        "rx_entry",
        32,
        # 16 octets in entry 0 leave 32 - 8 - 21 = 3 for entry 1.
        with_crc(
            bytes([0x00, 1, 0xFF, 0, 0x12, 0x11, 0x2A, 0, 1, 0, 16]) + bytes(16) + bytes([1, 0, 1])
        ),
    ),
    RefusalVector(
        "PAD, first octet",
        "rx_pad",
        32,
        with_crc(_HEADER + _ENTRY + bytes([1]) + bytes(12)),
    ),
    RefusalVector(
        "PAD, last octet",
        "rx_pad",
        32,
        with_crc(_HEADER + _ENTRY + bytes(12) + bytes([0x80])),
    ),
)
