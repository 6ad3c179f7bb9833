"""Golden vectors of LSA, ROUTE, BARE and of the NEED that answers a ROUTE.

Nothing of sdrlinkd is imported here. The octets are written out by hand from clauses 3.2, 6, 6.13
and 6.15 to 6.17 of sdrlinkd/wire/README.md: type, length, value.
"""

from tests.wire.vectors import RecordsVector

# Clause 6.15: node (1), number (2), then a robot and its loss for each that is heard.
# Node 3, number 0x1234: robot 1 at p = 1, robot 2 at p = 1/2 (1 bit = 16 sixteenths = 0x10),
# robot 7 at 3 sixteenths. 3 + 3 * 2 = 9 octets.
LSA = RecordsVector(
    "lsa",
    bytes([
        13, 9,
        3, 0x12, 0x34,
        1, 0x00,
        2, 0x10,
        7, 0x03,
    ]),
    (("LSA", (3, 0x1234, ((1, 0), (2, 16), (7, 3)))),),
)  # fmt: skip
# Node 9 hears nobody.
LSA_NOBODY = RecordsVector(
    "lsa_nobody",
    bytes([13, 3, 9, 0xFF, 0xFF]),
    (("LSA", (9, 0xFFFF, ())),),
)
# What LSA_DIGEST is the digest of: (node, number), ascending.
DIGESTED = [(1, 0x0005), (3, 0x1234), (9, 0xFFFF)]
# CRC-16/XMODEM of 01 00 05 03 12 34 09 FF FF: 0x793B, by the shift register and by long division.
LSA_DIGEST = RecordsVector(
    "lsa_digest",
    bytes([13, 3, 255, 0x79, 0x3B]),
    (("LSA", (255, 0x793B, ())),),
)

# (p, loss): -16 log2 p, rounded, 255 at most.
LOSSES = [
    (1.0, 0),
    (0.9, 2),  # 2.43
    (0.5, 16),
    (0.25, 32),
    (0.1, 53),  # 53.15
    (2**-15.9, 254),  # 254.4
    (1e-6, 255),  # 318.9
]

# (number, last number, is newer): by 1 to 32767 = 0x7FFF, modulo 65536.
NEWER = [
    (0x1234, 0x1234, False),  # by 0
    (0x1235, 0x1234, True),  # by 1
    (0x1233, 0x1234, False),  # by 65535
    (0x0000, 0x0000, False),
    (0x7FFF, 0x0000, True),  # by 32767
    (0x8000, 0x0000, False),  # by 32768
    (0x0000, 0x8000, False),  # by 32768, the other way round
    (0x8001, 0x0000, False),  # by 32769
    (0x0000, 0x8001, True),  # by 32767, the other way round
    (0xFFFF, 0x8000, True),  # by 32767, just before the wrap
    (0xFFFF, 0x7FFF, False),  # by 32768
    (0x0000, 0xFFFF, True),  # by 1, over the wrap
    (0xFFFF, 0x0000, False),  # by 65535
    (0x0002, 0xFFFE, True),  # by 4
    (0xFFFE, 0x0002, False),  # by 65532
    (0x7FFE, 0xFFFF, True),  # by 32767, over the wrap
    (0x7FFF, 0xFFFF, False),  # by 32768, over the wrap
]

# Clause 6.16: src (1), dst (1), PDU number (4), robots.
# From 0x00012345 on, robots 2 and 4 forward the PDUs of robot 1 to everyone. 6 + 2 = 8 octets.
ROUTE = RecordsVector(
    "route",
    bytes([
        14, 8,
        1,
        0xFF,
        0x00, 0x01, 0x23, 0x45,
        2, 4,
    ]),
    (("ROUTE", (1, 255, 0x00012345, b"\x02\x04")),),
)  # fmt: skip
# From 7 on, nobody forwards the PDUs of robot 1 to robot 5 any more.
ROUTE_NOBODY = RecordsVector(
    "route_nobody",
    bytes([14, 6, 1, 5, 0x00, 0x00, 0x00, 0x07]),
    (("ROUTE", (1, 5, 7, b"")),),
)
# Heard of PDUs of robot 1 up to 0x00012344: PDU number is the next one, and no bit is 1. A bitmap
# has one octet at least.
NEED_ANSWER = RecordsVector(
    "need_answer",
    bytes([10, 6, 1, 0x00, 0x01, 0x23, 0x45, 0x00]),
    (("NEED", (1, 0x00012345, b"\x00")),),
)

# Clause 6.17: seq (1), bitmap. Both records are in PDU number 1000, and begin with PDU 990, whose
# lowest octet is 990 - 3 * 256 = 222 = 0xDE. Bit b from the top stands for 990 + b.
BARE_IN = 1000
# Bits 0, 1 and 5 from the top: 1100 0100.
BARE = RecordsVector(
    "bare",
    bytes([21, 2, 0xDE, 0xC4]),
    (("BARE", (222, b"\xc4")),),
)
BARE_NUMBERS = (990, 991, 995)
# Bits 0 and 9 from the top: 1000 0000 0100 0000.
BARE_WIDE = RecordsVector(
    "bare_wide",
    bytes([21, 3, 0xDE, 0x80, 0x40]),
    (("BARE", (222, b"\x80\x40")),),
)
BARE_WIDE_NUMBERS = (990, 999)

ROUTE_RECORDS = (
    LSA, LSA_NOBODY, LSA_DIGEST, ROUTE, ROUTE_NOBODY, NEED_ANSWER, BARE, BARE_WIDE,
)  # fmt: skip
