"""Sealed PDUs against vectors that another hand computed from the wire document alone."""

import pytest

from sdrlinkd.sealing import Key
from sdrlinkd.sealing.testing import Ciphers
from sdrlinkd.wire import (
    Contact,
    KeyTold,
    Met,
    delayed,
    parse,
    parse_sealed,
    read_control_entries,
)
from tests.sealing import vectors

TEAM, PAIR = vectors.TEAM_KEY, vectors.PAIR_KEY
PAIRS = {frozenset((1, 2)): PAIR}
MODES = {vectors.SEAL: "seal", vectors.AUTH: "auth"}


def test_vectors_follow_from_their_fields():
    vectors.check()


@pytest.mark.parametrize("name", vectors.SEALED)
def test_opens_and_seals_again(name):
    fields, octets = vectors.SEALED[name], vectors.VECTORS[name]
    pdu = parse_sealed(octets, len(octets))
    ciphers = Ciphers(Key(pdu.kid, TEAM, PAIRS), MODES[fields.mode])
    inner = ciphers.open(pdu)
    assert inner is not None
    # What is inside needs no CRC of its own.
    assert inner[:-2] == vectors.clear(fields.pdu, len(octets) - 14)[:-2]
    assert parse(inner, len(inner), is_intact=True).src == pdu.src
    assert delayed(ciphers.seal(inner, pdu.ticks), 100 * pdu.held) == octets


def test_relayed():
    assert delayed(vectors.VECTORS["v3_limits"], 10**9, hops=1) == vectors.VECTORS["v4_relayed"]


def test_contact():
    octets = vectors.VECTORS["v6_contact"]
    pdu = parse_sealed(octets, len(octets))
    inner = Ciphers(Key(pdu.kid, TEAM), "seal").open(pdu)
    assert inner is not None
    (contact,) = read_control_entries(parse(inner, len(inner), is_intact=True)).records
    assert len(inner) == len(octets) - 14
    assert contact == Contact(
        bytes(range(0xA1, 0xA9)),
        (Met(2, bytes.fromhex("11223344"), 100), Met(9, bytes.fromhex("deadbeef"), -3)),
    )


def test_key_told_in_the_clear():
    octets, fingerprint = vectors.VECTORS["v7_clear_key"], vectors.VECTORS["v7_fingerprint"]
    (told,) = read_control_entries(parse(octets, len(octets))).records
    assert told == KeyTold(2, True, fingerprint[:4])
    assert Key(2, TEAM).fingerprint == fingerprint[:11]


def test_any_other_bit_closes_it():
    octets = vectors.VECTORS["v1_seal"]
    ciphers = Ciphers(Key(0, TEAM), "seal")
    for at in range(len(octets) - 2):
        for bit in range(8):
            changed = bytearray(octets)
            changed[at] ^= 1 << bit
            # What changes on the way is not sealed: the hops left, and the time held.
            is_open = (at == 4 and bit >= 4) or at in (9, 10)
            if not changed[4] & 0x0F or changed[0] >> 4:
                # No entries, or another version: not even tried.
                continue
            pdu = parse_sealed(vectors.with_crc(bytes(changed[:-2])), len(octets))
            # Its kid chooses the key, so there may be none to try.
            assert (ciphers.open(pdu) is not None) == is_open, (at, bit)
