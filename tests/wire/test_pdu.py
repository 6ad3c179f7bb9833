"""PDUs: what is built can be parsed, what is parsed is canonical, the rest is refused by name."""

import binascii
from collections import Counter
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import PduError
from sdrlinkd.wire import Entry, Pdu, build, entry_budget, identity, parse
from tests.laws import law, trials
from tests.wire.pdus import sized_pdus
from tests.wire.vectors import BY_NAME, PDUS, crc16_xmodem, reseal

REASONS = {"rx_short", "rx_crc", "rx_version", "rx_flags", "rx_entry", "rx_pad"}
HOP_BITS = range(4 * 8, 4 * 8 + 4)
CASES = trials(100_000)
SEED = 20250908


@pytest.mark.slow
@law(400)
@given(sized_pdus())
def test_parse_undoes_build(case):
    pdu, pdu_size = case
    octets = build(pdu, pdu_size)
    assert len(octets) == pdu_size
    assert crc16_xmodem(octets[:-2]) == int.from_bytes(octets[-2:], "big")
    assert parse(octets, pdu_size) == pdu


@pytest.mark.slow
@law(200)
@given(sized_pdus(), st.integers(0, 15))
def test_identity_outlives_relays(case, hop):
    pdu, pdu_size = case
    relayed = build(pdu._replace(hop=hop), pdu_size)
    assert identity(relayed) == identity(build(pdu, pdu_size))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["single", "fifteen", "two_padded", "message_and_stamp"])
def test_identity_tells_any_other_bit(name):
    octets = BY_NAME[name].octets
    for bit in range(len(octets[:-2]) * 8):
        other = reseal(flip(octets, bit))
        assert (identity(other) == identity(octets)) == (bit in HOP_BITS), f"bit {bit}"


@pytest.mark.parametrize("vector", [v for v in PDUS if v.pdu_size <= 220], ids=lambda v: v.name)
def test_any_flipped_bit_is_refused(vector):
    for bit in range(vector.pdu_size * 8):
        with pytest.raises(PduError) as refused:
            parse(flip(vector.octets, bit), vector.pdu_size)
        assert refused.value.reason == "rx_crc", f"bit {bit}"


@pytest.mark.parametrize("vector", PDUS, ids=lambda v: v.name)
def test_any_truncation_is_refused(vector):
    for size in range(vector.pdu_size):
        with pytest.raises(PduError) as refused:
            parse(vector.octets[:size], vector.pdu_size)
        assert refused.value.reason == "rx_short"


@pytest.mark.slow
def test_any_bytes_parse_or_are_refused_by_name():
    rng = Random(SEED)
    verdicts = Counter()
    for case in range(CASES):
        octets, pdu_size = any_octets(rng)
        where = f"seed {SEED} case {case}, pdu_size {pdu_size}: {octets.hex()}"
        try:
            pdu = parse(octets, pdu_size)
        except PduError as refused:
            verdict = refused.reason
        except Exception as error:
            raise AssertionError(where) from error
        else:
            verdict = "parsed"
            assert build(pdu, pdu_size) == octets, where
        assert verdict in {"parsed", *REASONS}, where
        verdicts[verdict] += 1
    # If the generator yielded only garbage, the loop above would prove little.
    assert verdicts["parsed"] > CASES // 5, verdicts
    assert all(verdicts[reason] > CASES // 500 for reason in REASONS), verdicts


@pytest.mark.parametrize(
    "change",
    [
        {"qos": -1},
        {"qos": 4},
        {"src": -1},
        {"src": 256},
        {"dst": -1},
        {"dst": 256},
        {"seq": -1},
        {"seq": 256},
        {"hop": -1},
        {"hop": 16},
        {"entries": []},
        {"entries": [Entry(0, 0, 0, 1, b"")] * 16},
    ],
    ids=str,
)
def test_header_field_out_of_range(change):
    pdu = Pdu(0, False, 1, 255, 0, 1, [Entry(1, 2, 0, 1, b"x")])
    build(pdu, 220)
    with pytest.raises(ValueError):
        build(pdu._replace(**change), 220)


@pytest.mark.parametrize(
    "change",
    [
        {"topic_id": -1},
        {"topic_id": 256},
        {"topic_id": 271},
        {"entry_id": -1},
        {"entry_id": 256},
        {"index": -1},
        {"index": 3},
        {"index": 255, "total": 256},
        {"index": 0, "total": 0},
        {"index": -2, "total": -1},
        {"total": 256},
    ],
    ids=str,
)
@pytest.mark.parametrize("others", [0, 1, 14])
def test_entry_field_out_of_range(change, others):
    entry = Entry(1, 2, 2, 3, b"x")
    rest = [Entry(0, 0, 0, 1, b"")] * others
    build(Pdu(0, False, 1, 255, 0, 1, [*rest, entry]), 220)
    with pytest.raises(ValueError):
        build(Pdu(0, False, 1, 255, 0, 1, [*rest, entry._replace(**change)]), 220)


@pytest.mark.parametrize(
    ("pdu_size", "payload_sizes"),
    [(32, [19]), (220, [207]), (220, [101, 101]), (220, [202, 0]), (110, [1] * 14 + [6])],
)
def test_one_octet_more_than_fits(pdu_size, payload_sizes):
    entries = [Entry(0, i, 0, 1, bytes(k)) for i, k in enumerate(payload_sizes)]
    assert len(build(Pdu(0, False, 0, 255, 0, 1, entries), pdu_size)) == pdu_size
    entries[-1] = entries[-1]._replace(payload=bytes(payload_sizes[-1] + 1))
    with pytest.raises(ValueError, match="bytes"):
        build(Pdu(0, False, 0, 255, 0, 1, entries), pdu_size)


def test_payload_longer_than_its_length_field():
    pdu = Pdu(0, False, 0, 255, 0, 1, [Entry(0, 0, 0, 1, bytes(65_536))])
    with pytest.raises(ValueError):
        build(pdu, 70_000)


def test_refusals_come_in_the_order_of_the_document():
    octets = bytearray(BY_NAME["single"].octets)
    octets[-3] = 1
    assert reason_of(reseal(octets)) == "rx_pad"
    octets[5] |= 1
    assert reason_of(reseal(octets)) == "rx_entry"
    octets[0] |= 0x01
    assert reason_of(reseal(octets)) == "rx_flags"
    octets[0] |= 0xF0
    assert reason_of(reseal(octets)) == "rx_version"
    assert reason_of(octets) == "rx_crc"
    assert reason_of(octets[:-1]) == "rx_short"


def reason_of(octets):
    with pytest.raises(PduError) as refused:
        parse(bytes(octets), 32)
    return refused.value.reason


def flip(octets, bit):
    flipped = bytearray(octets)
    flipped[bit // 8] ^= 0x80 >> bit % 8
    return bytes(flipped)


def any_octets(rng):
    """Octets and a pdu_size: garbage, valid, or valid and then damaged."""
    kind = rng.randrange(10)
    if kind == 0:
        return rng.randbytes(rng.randrange(70)), 32
    if kind == 1:
        return sealed(rng.randbytes(30)), 32
    if kind == 2:
        # Totals, lengths and PAD consist of small numbers.
        header = bytes([rng.choice([0, 4, 8, 12]), 1, 255, 0, 0x10 | rng.randrange(4)])
        return sealed(header + bytes(rng.choices((0, 0, 0, 1, 2), k=25))), 32
    octets, pdu_size = random_pdu(rng)
    if kind < 6:
        return octets, pdu_size
    damaged = bytearray(octets)
    match rng.randrange(5):
        case 0:
            damaged[rng.randrange(pdu_size)] ^= 1 << rng.randrange(8)
        case 1:
            damaged[rng.randrange(min(16, pdu_size))] = rng.randrange(256)
        case 2:
            del damaged[rng.randrange(pdu_size)]
            damaged += bytes(rng.randrange(3))
        case 3:
            damaged[-3] = rng.randrange(256)
        case 4:
            for _ in range(rng.randrange(1, 6)):
                damaged[rng.randrange(pdu_size)] = rng.randrange(256)
    if kind < 9 and len(damaged) >= 7:
        return sealed(bytes(damaged[:-2])), pdu_size
    return bytes(damaged), pdu_size


def random_pdu(rng):
    pdu_size = rng.choice((32, 32, 48, 110, 220))
    n = rng.choice((1, 1, 1, 2, 2, 3, 4, 15))
    while entry_budget(pdu_size, n) < 5 * n:
        n -= 1
    room = entry_budget(pdu_size, n) - 5 * n
    topic_ids = [rng.randrange(16) for _ in range(n)] + [0]
    body = bytes([rng.randrange(8) << 1]) + rng.randbytes(3) + bytes([rng.randrange(16) << 4 | n])
    body += bytes(topic_ids[i] << 4 | topic_ids[i + 1] for i in range(0, n, 2))
    for _ in range(n):
        k = rng.randint(0, room)
        room -= k
        total = rng.randint(1, 255)
        body += bytes([rng.randrange(256), rng.randrange(total), total, k >> 8, k & 0xFF])
        body += rng.randbytes(k)
    return sealed(body.ljust(pdu_size - 2, b"\0")), pdu_size


def sealed(body):
    """Like vectors.with_crc, but fast enough for 10^5 cases."""
    return body + binascii.crc_hqx(body, 0).to_bytes(2, "big")


@pytest.mark.parametrize("flags", [0x01, 0x03])
def test_what_is_sealed_is_refused(flags):
    octets = bytearray(build(Pdu(0, False, 1, 255, 0, 1, [Entry(1, 0, 0, 1, b"abcd")]), 32))
    octets[0] |= flags
    octets[-2:] = crc16_xmodem(bytes(octets[:-2])).to_bytes(2, "big")
    with pytest.raises(PduError) as refused:
        parse(bytes(octets), 32)
    assert refused.value.reason == "rx_flags"
