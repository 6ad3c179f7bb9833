"""Changes inputs as their format allows: fields, records, keys and values, with true checksums."""

import json
from collections.abc import Callable
from random import Random

from sdrlinkd.sealing import Sealing, SecurityParams
from sdrlinkd.wire import (
    SEAL_OVERHEAD,
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
    crc16,
)
from tests.fuzz.targets import KEY, NEW, PDU_SIZE

EDGES = (0, 1, 2, 3, 4, 5, 6, 13, 14, 15, 16, 17, 127, 128, 254, 255)
WORDS = ("0", "-1", "1e999", "nan", '""', "[]", "{}", "true", "9" * 30, '"9 GHz"', "0x7f", "null")
KINDS = (
    1,
    2,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
    10,
    11,
    12,
    13,
    14,
    15,
    17,
    18,
    19,
    20,
    21,
    22,
    23,
    24,
    27,
    28,
    29,
    99,
)
RECORDS = (
    Stamp(1, 2, 3), Stamp(1, 2, 3, asks=True), Beacon(1, 2), Beacon(1, 2, 3),
    RegistryDigest(bytes(8), b"abc"), LinkReport(2, -3, 4, 5), Receipt(1, 2, 1),
    Receipt(1, 2, 1, 3, 4, 5), Parity(1, 2, 4, 1, 0, 0, 20, 75, b"parity"), Frame(1, 0, 2, 3),
    Clock(1, 2, 1, 5, arrivals=(Arrival(2, 3, 40),), pdu_number=9), Waits(1, 85, 85, 85),
    Need(1, 300, b"\x81"), TopicPiece(16, 7, 0, 1, b"\0\0" + bytes(8) + b"odom\0pkg/msg/Odom"),
    Wanted(1, b"\x10\x11"), RatesAsked(1, ((16, 80), (17, 0))), Repeat(1, 300, 12, 2),
    Contact(bytes(8), (Met(2, bytes(4), 3),)), KeyTold(1, False, bytes(4)),
    LostNumbers(1, bytes(4), bytes(8)), FoundNumbers(1, bytes(8), 0, 3, 4),
    Lsa(1, 7, ((2, 3), (3, 16))), Lsa(255, 0x1234), Route(2, 255, 300, b"\1\3"), Bare(44, b"\xa1"),
    Want(1, 0, 64, 3, 40, 50), Grant(7, 1, 900, ((1, 9), (5, 0), (255, 3))),
    Flows(1, 7, (ReservedFlow(0, 255, 3, 64, 300, 20_000, 900),)), Flows(2, 8),
    Admit(1, 9, 2, b"\0", b"\1"),
)  # fmt: skip
BUILT = [build_records([record]) for record in RECORDS]


def octets(data: bytes, chance: Random) -> bytes:
    """Some octets changed, cut, doubled or moved."""
    changed = bytearray(data or b"\0")
    for _ in range(chance.randrange(1, 5)):
        at = chance.randrange(len(changed) + 1)
        what = chance.randrange(5)
        if what == 0 and at < len(changed):
            changed[at] = chance.choice(EDGES)
        elif what == 1 and at < len(changed):
            changed[at] ^= 1 << chance.randrange(8)
        elif what == 2:
            changed[at:at] = chance.randbytes(chance.randrange(1, 9))
        elif what == 3:
            del changed[at : at + chance.randrange(1, 9)]
        else:
            end = min(len(changed), at + chance.randrange(1, 65))
            changed[at:at] = changed[at:end]
    return bytes(changed)


def with_crc(data: bytes) -> bytes:
    """A PDU whose last two octets are the CRC of those before."""
    return data[:-2] + crc16(data[:-2]).to_bytes(2, "big")


def one_record(chance: Random) -> bytes:
    """A control record: one of RECORDS with other fields, or any type with any octets."""
    if chance.random() < 0.5:
        known = bytearray(chance.choice(BUILT))
        for _ in range(chance.randrange(3)):
            known[chance.randrange(2, len(known))] = chance.choice(EDGES)
        return bytes(known)
    # Readers ignore what follows the fields that they know, so most long values are valid.
    value = chance.randbytes(chance.choice((0, 3, 4, 6, 8, 13, 24, 28, 31, 31, 40, 40)))
    length = len(value) if chance.random() < 0.9 else chance.randrange(256)
    return bytes((chance.choice(KINDS), length)) + value


def some_records(chance: Random) -> bytes:
    """The payload of a control entry."""
    return b"".join(one_record(chance) for _ in range(chance.choice((1, 1, 2, 4))))


def one_pdu(chance: Random, size: int = PDU_SIZE) -> bytes:
    """A PDU with a true CRC and some entries, mostly in canonical form."""
    body = size - 2
    n, entries, ids = 0, b"", []
    while n < chance.randrange(1, 6):
        topic = chance.choice((0, 1, 14, 15, 15, 15))
        payload = some_records(chance) if topic == 15 else chance.randbytes(chance.randrange(0, 30))
        total = 1 if topic == 15 else chance.choice((1, 1, 2, 3, 255))
        head = bytes((chance.randrange(4), chance.randrange(total), total))
        entry = head + len(payload).to_bytes(2, "big") + payload
        if 5 + (n + 2) // 2 + len(entries) + len(entry) > body:
            break
        entries += entry
        ids.append(topic)
        n += 1
    packed = bytes(
        first << 4 | second for first, second in zip(ids[::2], [*ids[1::2], 0], strict=False)
    )
    head = bytes(
        (
            chance.choice((0, 4, 8, 12, 2)), chance.choice((1, 1, 3, 2, 255)),
            chance.choice((255, 2, 3)), chance.randrange(256), chance.randrange(1, 4) << 4 | n,
        )
    )  # fmt: skip
    octets_ = head + packed + entries
    return with_crc((octets_ + bytes(size))[:size])


class Source:
    """Another robot with the key of the target, which seals what nobody would send."""

    def __init__(self) -> None:
        self._sealing = Sealing(
            1,
            PDU_SIZE,
            SecurityParams(mode="seal"),
            [KEY],
            NEW,
            Random(2).randbytes,
        )
        self._now = 0.0

    def sealed(self, chance: Random) -> bytes:
        """A PDU that opens, whatever is inside."""
        sealing = self._sealing
        self._now += 1 / 32
        wanted = sealing.memory.wanted(self._now)
        if wanted is not None:
            sealing.memory.written(wanted)
        inner = bytearray(one_pdu(chance, PDU_SIZE - SEAL_OVERHEAD))
        inner[0] &= 0xFE
        inner[1] = 1
        if not sealing.may_send(self._now, inner[3], 1):
            return bytes(inner)
        return sealing.seal(bytes(inner), self._now)


SOURCE = Source()


def sealed(data: bytes, chance: Random) -> bytes:
    """A PDU that opens, or one with a changed octet and a true CRC."""
    if chance.random() < 0.5:
        return SOURCE.sealed(chance)
    return with_crc((octets(data, chance) + bytes(PDU_SIZE))[:PDU_SIZE])


def pdus(data: bytes, chance: Random) -> bytes:
    """Some PDUs: others, changed ones, copies, in another order."""
    if len(data) % PDU_SIZE or not data or chance.random() < 0.1:
        return octets(data, chance)
    each = [data[at : at + PDU_SIZE] for at in range(0, len(data), PDU_SIZE)]
    at = chance.randrange(len(each))
    what = chance.randrange(4)
    if what == 0:
        each[at] = one_pdu(chance)
    elif what == 1:
        each[at] = with_crc((octets(each[at], chance) + bytes(PDU_SIZE))[:PDU_SIZE])
    elif what == 2:
        each.insert(at, chance.choice(each))
    else:
        chance.shuffle(each)
    return b"".join(each[:16])


def text(data: bytes, chance: Random) -> bytes:
    """A configuration with another value, a line twice, or a line less."""
    lines = data.decode("utf-8", "replace").splitlines()
    if not lines or chance.random() < 0.1:
        return octets(data, chance)
    at = chance.randrange(len(lines))
    what = chance.randrange(4)
    if what == 0 and "=" in lines[at]:
        lines[at] = f"{lines[at].split('=')[0]}= {chance.choice(WORDS)}"
    elif what == 1:
        lines.insert(at, chance.choice(lines))
    elif what == 2:
        del lines[at]
    else:
        lines[at] = octets(lines[at].encode(), chance).decode("utf-8", "replace")
    return "\n".join(lines).encode()


def tree(data: bytes, chance: Random) -> bytes:
    """JSON with another value somewhere."""
    try:
        root = json.loads(data)
    except (ValueError, RecursionError):
        return octets(data, chance)
    node = root
    for _ in range(4):
        if not node or not isinstance(node, dict | list):
            break
        keys = list(node) if isinstance(node, dict) else list(range(len(node)))
        key = chance.choice(keys)
        if chance.random() < 0.4 or not isinstance(node[key], dict | list):
            values = (None, -1, 0, 1e308, "x", [], {}, True, [[]], "core:sample_rate", 10**20)
            node[key] = chance.choice(values)
            break
        node = node[key]
    return json.dumps(root).encode()


MUTATORS: dict[str, Callable[[bytes, Random], bytes]] = {
    "pdu": lambda data, chance: with_crc(octets(data, chance) + b"\0\0"),
    "records": lambda data, chance: (data + one_record(chance))[-250:],
    "link": pdus,
    "sealed": sealed,
    "config": text,
    "sigmf": tree,
}
"""Mutators by target; the others change octets."""


def mutate(target: str, data: bytes, chance: Random) -> bytes:
    """An input like `data`: half of the time by the format, else any change of octets."""
    by_format = MUTATORS.get(target)
    if by_format is None or chance.random() < 0.5:
        return octets(data, chance)
    return by_format(data, chance)
