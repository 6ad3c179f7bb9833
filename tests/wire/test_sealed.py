"""The layout of a sealed PDU, whatever the cipher: it opens, and only hops and delay change."""

from hashlib import sha256

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.errors import PduError
from sdrlinkd.wire import (
    MIN_SEALED_SIZE,
    N_TICKS,
    SEAL_OVERHEAD,
    TAG_SIZE,
    Entry,
    Pdu,
    Stamp,
    build,
    build_records,
    build_sealed,
    delayed,
    forwarded,
    is_sealed,
    leaves_later,
    parse_sealed,
    postponed,
    relayed,
)
from tests.laws import law
from tests.wire.pdus import sized_pdus
from tests.wire.vectors import reseal

MOST_HELD = 0xFFFF


def masked(text):
    return bytes(each ^ 0x5A for each in text)


def tag(nonce, text, associated):
    return sha256(nonce + associated + text).digest()[:TAG_SIZE]


def encrypt(nonce, text, associated):
    return masked(text) + tag(nonce, text, associated)


def decrypt(nonce, secret, associated):
    text = masked(secret[:-TAG_SIZE])
    if secret[-TAG_SIZE:] != tag(nonce, text, associated):
        raise KeyError("tag")
    return text


def inner_pdu(hop=3, payload=b"abcd"):
    return build(Pdu(2, True, 7, 9, 200, hop, [Entry(1, 2, 0, 1, payload)]), 64)


@law(100)
@given(sized_pdus(), st.integers(0, 3), st.integers(0, N_TICKS - 1), st.integers(0, MOST_HELD))
def test_what_is_sealed_has_its_fields_and_opens_wherever_it_is_held(case, kid, ticks, held):
    pdu, pdu_size = case
    inner = build(pdu, pdu_size)
    octets = build_sealed(inner, kid, ticks, encrypt)
    size = pdu_size + SEAL_OVERHEAD
    assert len(octets) == size
    assert octets[5:11] == (kid << 30 | ticks).to_bytes(4, "big") + bytes(2)
    assert masked(octets[11:-10]) == inner[5:-2]
    assert reseal(octets) == octets
    for at, sealed in ((0, octets), (held, delayed(octets, 100 * held))):
        found = parse_sealed(sealed, size)
        assert found == (
            sealed, inner[0] | 1, pdu.src, pdu.dst, pdu.seq, inner[4], kid, ticks, at,
        )  # fmt: skip
        assert found.inner(decrypt) == inner[:-2] + bytes(2)


def test_the_cipher_is_given_what_is_unique_and_what_stays_the_same():
    given_to = []

    def noted(nonce, text, associated):
        given_to.append((nonce, text, associated))
        return encrypt(nonce, text, associated)

    octets = build_sealed(inner_pdu(), 2, 77, noted)
    number = (2 << 30 | 77).to_bytes(4, "big")
    assert given_to == [
        (bytes(8) + number + bytes([200]), inner_pdu()[5:-2],
         bytes([inner_pdu()[0] | 1, 7, 9, 200, 1]) + number + bytes(2)),
    ]  # fmt: skip
    for at in range(len(octets) - 2):
        changed = bytearray(octets)
        # The hops left, and the time for which it was held, may change.
        changed[at] ^= 0x0F if at == 4 else 0x02
        found = parse_sealed(reseal(bytes(changed)), len(octets))
        if at in (9, 10):
            assert found.inner(decrypt) == inner_pdu()[:-2] + bytes(2)
        else:
            with pytest.raises(KeyError):
                found.inner(decrypt)


def refusal(octets, size):
    with pytest.raises(PduError) as refused:
        parse_sealed(octets, size)
    return refused.value.reason


def test_what_cannot_be_a_sealed_pdu_is_refused_by_name():
    octets = build_sealed(inner_pdu(), 0, 5, encrypt)
    size = len(octets)
    assert refusal(octets, size + 1) == refusal(octets[:-1], size) == "rx_short"
    smallest = reseal(octets[: MIN_SEALED_SIZE - 2] + bytes(2))
    assert parse_sealed(smallest, MIN_SEALED_SIZE).src == 7
    small = reseal(octets[: MIN_SEALED_SIZE - 3] + bytes(2))
    assert refusal(small, MIN_SEALED_SIZE - 1) == "rx_short"
    assert refusal(octets[:-1] + bytes([octets[-1] ^ 1]), size) == "rx_crc"
    assert refusal(reseal(bytes([octets[0] | 0x10]) + octets[1:]), size) == "rx_version"
    assert refusal(reseal(octets[:4] + b"\x30" + octets[5:]), size) == "rx_entry"


@pytest.mark.parametrize(
    ("by_us", "held"),
    [
        (-50, 0), (0, 0), (1, 1), (100, 1), (101, 2), (6_553_400, 0xFFFE), (6_553_401, MOST_HELD),
        (1 << 40, MOST_HELD),
    ],
)  # fmt: skip
def test_a_delay_is_told_in_tenths_of_a_millisecond_rounded_up(by_us, held):
    octets = build_sealed(inner_pdu(), 1, 5, encrypt)
    later = delayed(octets, by_us)
    assert later == reseal(octets[:9] + held.to_bytes(2, "big") + octets[11:])
    twice = int.from_bytes(delayed(later, by_us)[9:11], "big")
    assert twice == min(2 * held, MOST_HELD), "delays add up"


@pytest.mark.parametrize(("hop", "hops", "left"), [(3, 1, 2), (3, 2, 1), (2, 1, 1), (1, 0, 1)])
def test_each_relay_takes_a_hop_and_the_last_one_stays(hop, hops, left):
    octets = build_sealed(inner_pdu(hop), 1, 5, encrypt)
    assert delayed(octets, 0, hops) == reseal(octets[:4] + bytes([left << 4 | 1]) + octets[5:])
    with pytest.raises(ValueError, match=f"{hop} hops left"):
        delayed(octets, 0, hop)


def test_sealed_or_not_a_pdu_is_relayed_and_leaves_later():
    clear = build(
        Pdu(0, False, 1, 255, 0, 3, [Entry(15, 0, 0, 1, build_records([Stamp(1, 2, 3)]))]), 32
    )
    sealed = build_sealed(clear, 0, 0, encrypt)
    assert (is_sealed(b""), is_sealed(clear), is_sealed(sealed)) == (False, False, True)
    assert relayed(sealed, 500, True) == delayed(sealed, 500, 1)
    assert leaves_later(sealed, 500) == delayed(sealed, 500)
    for has_control in (True, False):
        assert relayed(clear, 500, has_control) == forwarded(clear, 500, has_control)
    assert forwarded(clear, 500, False)[:-2] == clear[:4] + b"\x21" + clear[5:-2]
    assert leaves_later(clear, 500) == postponed(clear, 500) != clear
