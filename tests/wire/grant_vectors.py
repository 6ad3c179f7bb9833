"""Golden vectors of WANT and of GRANT with its FRAME.

Nothing of sdrlinkd is imported here. The octets are written out by hand from clauses 6, 6.4, 6.18
and 6.19 of sdrlinkd/wire/README.md: type, length, value. So are the codes, the times of the turns
and the schedule value.
"""

from tests.wire.vectors import RecordsVector

# Clause 6.18: node (1), then 32 bits: class (2), priority (7), age (7), air (8), lower air (8).
# The first three fill two octets, so air and lower air have an octet each. 1 + 4 = 5 octets.
#
# Node 5. Class 1 = 01, latency; priority 100 = 1100100; age 33 = 0100001, 1 ms * 2**(32/8) = 16 ms:
# 01 1100100 0100001 = 0111 0010 0010 0001 = 72 21.
# air 49 = 0x31, 50 µs * 2**(48/8) = 3.2 ms; lower air 81 = 0x51, 50 µs * 2**(80/8) = 51.2 ms.
WANT = RecordsVector(
    "want",
    bytes([
        11, 5,
        5,
        0x72, 0x21,
        0x31, 0x51,
    ]),
    (("WANT", (5, 1, 100, 33, 49, 81)),),
)  # fmt: skip
# Node 254 = 0xFE, and 32 ones: 11 1111111 1111111 11111111 11111111.
WANT_MOST = RecordsVector(
    "want_most",
    bytes([11, 5, 0xFE, 0xFF, 0xFF, 0xFF, 0xFF]),
    (("WANT", (254, 3, 127, 127, 255, 255)),),
)
# Node 5 has nothing to send any more: air and lower air 0. Class 3 = 11, bulk, priority and age 0:
# 11 0000000 0000000 = 1100 0000 0000 0000 = C0 00.
WANT_WITHDRAWN = RecordsVector(
    "want_withdrawn",
    bytes([11, 5, 5, 0xC0, 0x00, 0x00, 0x00]),
    (("WANT", (5, 3, 0, 0, 0, 0)),),
)

# Clause 6.19: number (1), reach (1), begins (4), then a robot and its ticks for each turn.
# The root's round 7; the farthest robot is 2 hops away; the first turn begins 8000 µs = 0x00001F40
# after the reference. Robot 2 has 40 = 0x28 ticks, robot 3 12 = 0x0C, robot 7 25 = 0x19.
# 6 + 3 * 2 = 12 octets.
GRANT = RecordsVector(
    "grant",
    bytes([
        12, 12,
        7,
        2,
        0x00, 0x00, 0x1F, 0x40,
        2, 40,
        3, 12,
        7, 25,
    ]),
    (("GRANT", (7, 2, 8000, ((2, 40), (3, 12), (7, 25)))),),
)  # fmt: skip
# Round 255, reach not known: 255. Begins after 70 123 µs = 0x000111EB. Robot 254 has 255 ticks, the
# most that there are; then 8 ticks for anybody (255). 6 + 2 * 2 = 10 octets.
GRANT_ANYBODY = RecordsVector(
    "grant_anybody",
    bytes([12, 10, 0xFF, 0xFF, 0x00, 0x01, 0x11, 0xEB, 0xFE, 0xFF, 0xFF, 8]),
    (("GRANT", (255, 255, 70_123, ((254, 255), (255, 8)))),),
)
# Round 0, 3 hops, begins after 300 µs = 0x0000012C. Robot 2 has 20 ticks; back by 13 ticks; robot 5
# has 12. 6 + 3 * 2 = 12 octets.
GRANT_BACK = RecordsVector(
    "grant_back",
    bytes([12, 12, 0, 3, 0x00, 0x00, 0x01, 0x2C, 2, 20, 13, 0, 5, 12]),
    (("GRANT", (0, 3, 300, ((2, 20), (13, 0), (5, 12)))),),
)
# Round 128 has no turns; it begins 2**32 - 1 µs after the reference. 6 octets.
GRANT_NOBODY = RecordsVector(
    "grant_nobody",
    bytes([12, 6, 0x80, 1, 0xFF, 0xFF, 0xFF, 0xFF]),
    (("GRANT", (128, 1, 4_294_967_295, ())),),
)
# Robot 2 passes GRANT on: the root is robot 1, 1 hop away; the schedule value is 0x51DE (SCHEDULE
# below). With its ticks of 500 µs, robot 2's turn is from 8000 to 28 000 µs after the reference.
# Its burst leaves 137 µs into it: 8137 µs = 0x00001FC9. FRAME has 8 octets, GRANT 12 as above.
FRAME_GRANT = RecordsVector(
    "frame_grant",
    bytes([
        7, 8,
        1, 1, 0x51, 0xDE,
        0x00, 0x00, 0x1F, 0xC9,
        12, 12,
        7, 2,
        0x00, 0x00, 0x1F, 0x40,
        2, 40,
        3, 12,
        7, 25,
    ]),
    (
        ("FRAME", (1, 1, 0x51DE, 8137)),
        ("GRANT", (7, 2, 8000, ((2, 40), (3, 12), (7, 25)))),
    ),
)  # fmt: skip

GRANT_RECORDS = [
    WANT, WANT_MOST, WANT_WITHDRAWN,
    GRANT, GRANT_ANYBODY, GRANT_BACK, GRANT_NOBODY, FRAME_GRANT,
]  # fmt: skip

# Clause 6.18: code 0 stands for no time, c > 0 for u * 2**((c - 1)/8). Rounded up, the code of a
# time t > 0 is the least c >= 1 with 8 log2(t/u) <= c - 1; the highest one if there is none.
#
# (time in s, code) of airtimes, u = 50 µs, codes up to 255: 50 µs * 2**(254/8) = 180 581 s.
AIR_CODES = [
    (0.0, 0),
    (0.000_01, 1),  # u/5: the least code of a time
    (0.000_05, 1),  # u: 8 * 0
    (0.000_051, 2),  # 1.02 u: 8 * 0.02857 = 0.23, up to 1
    (0.000_054, 2),  # 1.08 u: 0.888, up to 1; code 2 is 54.525 µs
    (0.000_055, 3),  # 1.1 u: 1.10003, up to 2
    (0.000_1, 9),  # 2 u: 8 * 1
    (0.003, 49),  # 60 u: 8 * 5.90689 = 47.26, up to 48
    (0.003_2, 49),  # 64 u: 8 * 6
    (0.02, 71),  # 400 u: 8 * 8.64386 = 69.15, up to 70
    (0.051_2, 81),  # 1024 u: 8 * 10
    (1.0, 116),  # 20 000 u: 8 * 14.28771 = 114.30, up to 115
    (165_000.0, 254),  # 3.3e9 u: 8 * 31.61982 = 252.96, up to 253
    (180_000.0, 255),  # 3.6e9 u: 8 * 31.74535 = 253.96, up to 254
    (200_000.0, 255),  # 4e9 u: 255.18, beyond 254
    (1_000_000.0, 255),  # 2e10 u: 273.75
]
# (time in s, code) of ages, u = 1 ms, codes up to 127: 1 ms * 2**(126/8) = 55.109 s.
AGE_CODES = [
    (0.0, 0),
    (0.000_4, 1),  # 0.4 u: the least code of a time
    (0.001, 1),  # u: 8 * 0
    (0.001_001, 2),  # 1.001 u: 8 * 0.001442 = 0.0115, up to 1
    (0.001_1, 3),  # 1.1 u: 1.10003, up to 2
    (0.002_5, 12),  # 2.5 u: 8 * 1.32193 = 10.58, up to 11
    (0.016, 33),  # 16 u: 8 * 4
    (0.1, 55),  # 100 u: 8 * 6.64386 = 53.15, up to 54
    (1.0, 81),  # 1000 u: 8 * 9.96578 = 79.73, up to 80
    (32.768, 121),  # 32 768 u: 8 * 15
    (50.0, 126),  # 50 000 u: 8 * 15.60964 = 124.88, up to 125
    (55.0, 127),  # 55 000 u: 8 * 15.74714 = 125.98, up to 126
    (55.2, 127),  # 55 200 u: 126.02, beyond 126
    (3600.0, 127),  # 3.6e6 u: 174.24
]

# Clause 6.19: (tick, guard, begin of the first turn, turns, (turns with their times, end)), in µs.
# A turn of t ticks that begins at b ends at b + t * tick; the next one begins a guard time after
# that. (n, 0) has the next one begin n ticks earlier. The end is that of the guard time that ends
# last.
TURNS = [
    # One after the other.
    # Robot 2: 8000 + 40 * 500 = 28 000. Robot 3: + 300 = 28 300, + 12 * 500 = 34 300.
    # Robot 7: + 300 = 34 600, + 25 * 500 = 47 100. End: + 300 = 47 400.
    (
        500, 300, 8000,
        ((2, 40), (3, 12), (7, 25)),
        ([(2, 8000, 28_000), (3, 28_300, 34_300), (7, 34_600, 47_100)], 47_400),
    ),
    # Back to just behind the begin of a longer turn: 12 ticks leave the 300 µs of the guard time.
    # Robot 2: 8000 + 20 * 500 = 18 000. Next: 18 300 - 12 * 500 = 12 300.
    # Robot 5: 12 300 + 6 * 500 = 15 300. End: robot 2's 18 000 + 300 = 18 300, not 15 600.
    (
        500, 300, 8000,
        ((2, 20), (12, 0), (5, 6)),
        ([(2, 8000, 18_000), (5, 12_300, 15_300)], 18_300),
    ),
    # A guard time of whole ticks: both begin together. The turn after that follows the last one of
    # the list.
    # Robot 2: 1000 + 8 * 250 = 3000. Next: 3500 - 10 * 250 = 1000. Robot 5: 1000 + 8 * 250 = 3000.
    # Anybody: + 500 = 3500, + 4 * 250 = 4500. End: + 500 = 5000.
    (
        250, 500, 1000,
        ((2, 8), (10, 0), (5, 8), (255, 4)),
        ([(2, 1000, 3000), (5, 1000, 3000), (255, 3500, 4500)], 5000),
    ),
    # Back by more ticks than an octet holds: 255 + 3 = 258.
    # Robot 2: 255 * 100 = 25 500. Robot 3: + 100 = 25 600, + 10 * 100 = 26 600.
    # Next: 26 700 - 258 * 100 = 900. Robot 9: 900 + 20 * 100 = 2900. End: 26 600 + 100 = 26 700.
    (
        100, 100, 0,
        ((2, 255), (3, 10), (255, 0), (3, 0), (9, 20)),
        ([(2, 0, 25_500), (3, 25_600, 26_600), (9, 900, 2900)], 26_700),
    ),
    # Robot 1, the root, keeps the air free for 4 ticks. That is a turn like any other.
    # Robot 2: 8000 + 10 * 500 = 13 000. Robot 1: + 300 = 13 300, + 4 * 500 = 15 300.
    # Robot 7: + 300 = 15 600, + 6 * 500 = 18 600. End: + 300 = 18 900.
    (
        500, 300, 8000,
        ((2, 10), (1, 4), (7, 6)),
        ([(2, 8000, 13_000), (1, 13_300, 15_300), (7, 15_600, 18_600)], 18_900),
    ),
]  # fmt: skip

# Clause 6.19: (tick, guard, least turn, budget, robots, schedule), in µs. The octets are
#     0C            12, for GRANT
#     00 00 01 F4   500, the tick
#     00 00 01 2C   300, the guard time
#     00 00 0F A0   4000, the least turn
#     00 01 86 A0   100 000, the budget
#     01 02 03 07   the robots, ascending
# CRC-16/XMODEM of these 21: 0x51DE, by the shift register.
SCHEDULE = (500, 300, 4000, 100_000, (1, 2, 3, 7), 0x51DE)
