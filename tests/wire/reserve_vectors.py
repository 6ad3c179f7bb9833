"""Golden vectors of FLOWS and ADMIT.

Nothing of sdrlinkd is imported here. The octets are written out by hand from clauses 6.20 and 6.21
of sdrlinkd/wire/README.md: type, length, value.
"""

from tests.wire.vectors import RecordsVector

# Clause 6.20: node (1), number (2), then 14 octets a flow: topic (1), dst (1), class and priority
# (2), air (2), period (4), size (4). 3 + 2 * 14 = 31 octets.
#
# Node 3, number 0x1234. Topic 1 to everyone, class 3 = 11, priority 64 = 1000000:
# 11 1000000 = 1 1100 0000 = 01 C0. Air 0x0CCD = 3277, a tenth of 32768. 20 ms = 20000 µs = 0x4E20.
# 1024 octets = 0x0400.
# Topic 17 = 0x11 to robot 2, class 0, priority 127: 00 1111111 = 00 7F. Air 0x8000, all of it.
# An hour = 3600000000 µs = 0xD693A400. 64 octets = 0x40.
FLOWS = RecordsVector(
    "flows",
    bytes([
        22, 31,
        3, 0x12, 0x34,
        1, 0xFF, 0x01, 0xC0, 0x0C, 0xCD, 0x00, 0x00, 0x4E, 0x20, 0x00, 0x00, 0x04, 0x00,
        17, 2, 0x00, 0x7F, 0x80, 0x00, 0xD6, 0x93, 0xA4, 0x00, 0x00, 0x00, 0x00, 0x40,
    ]),
    ((
        "FLOWS",
        (3, 0x1234, (
            (1, 255, 3, 64, 3277, 20_000, 1024),
            (17, 2, 0, 127, 32768, 3_600_000_000, 64),
        )),
    ),),
)  # fmt: skip
FLOWS_NONE = RecordsVector(
    "flows_none", bytes([22, 3, 9, 0xFF, 0xFF]), (("FLOWS", (9, 0xFFFF, ())),)
)

# Clause 6.21: planner (1), number (2), node (1), count (1), topics. Robot 1 admits topics 1 and 17
# of robot 3, and refuses topic 2. 5 + 3 = 8 octets.
ADMIT = RecordsVector(
    "admit",
    bytes([23, 8, 1, 0x00, 0x07, 3, 2, 1, 17, 2]),
    (("ADMIT", (1, 7, 3, b"\x01\x11", b"\x02")),),
)
ADMIT_NOTHING = RecordsVector(
    "admit_nothing",
    bytes([23, 5, 1, 0x12, 0x34, 3, 0]),
    (("ADMIT", (1, 0x1234, 3, b"", b"")),),
)

RESERVE_RECORDS = (FLOWS, FLOWS_NONE, ADMIT, ADMIT_NOTHING)
