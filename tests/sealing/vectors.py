"""Golden vectors of sealed PDUs, wire format version 0.

Nothing of sdrlinkd is imported here. All octets follow from sdrlinkd/wire/README.md alone. Only
the AES block comes from a library. CCM, HKDF and the CRC are written out. Which clause gives which
octet of a sealed PDU:

    octets 0-4    11.1  the header of the inner PDU (clause 3), with bit 0 of octet 0 (E) set
    octets 5-8    11.1  kid in bits 31-30, T in bits 29-0
    octets 9, 10  11.1  held, in 0.1 ms
    body          11.1  topic ids, entries and PAD of the inner PDU: pdu_size - 21 octets
    tag           11.1  8 octets of CCM
    CRC           5.2   over all octets before it

Run this file to compute each vector again. It prints OK.
"""

import hashlib
import hmac
import struct
import sys
from typing import NamedTuple

from cryptography.hazmat.primitives.ciphers import Cipher, algorithms, modes

SEAL, AUTH = 1, 2
DEFAULT, LATENCY, BULK, URGENT = 0b00, 0b01, 0b10, 0b11
EVERYONE = 0xFF
CONTROL = 0xF
TEAM_KEY = bytes(range(32))
PAIR_KEY = bytes(range(32, 64))


def crc16(octets: bytes) -> int:
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
    return body + crc16(body).to_bytes(2, "big")


def hkdf(key: bytes, salt: bytes, info: bytes, length: int) -> bytes:
    """HKDF-SHA256 (RFC 5869). No salt is the same as 32 zeros."""
    secret = hmac.digest(salt or bytes(32), key, "sha256")
    block, okm = b"", b""
    for number in range(1, -(-length // 32) + 1):
        block = hmac.digest(secret, block + info + bytes([number]), "sha256")
        okm += block
    return okm[:length]


def xor(a: bytes, b: bytes) -> bytes:
    """The bits in which two blocks differ. The longer one is cut."""
    return bytes(x ^ y for x, y in zip(a, b, strict=False))


def blocks(octets: bytes) -> list[bytes]:
    """Blocks of 16 octets. The last one is filled up with zeros."""
    return [octets[at : at + 16].ljust(16, b"\0") for at in range(0, len(octets), 16)]


def ccm_seal(key: bytes, nonce: bytes, associated: bytes, message: bytes) -> tuple[bytes, bytes]:
    """The encrypted message and its tag: AES-128 in CCM mode (RFC 3610), M = 8, L = 2."""
    if len(key) != 16 or len(nonce) != 13 or not 0 < len(associated) < 0xFF00:
        raise ValueError("only the case of clause 11.1 is written here")
    aes = Cipher(algorithms.AES(key), modes.ECB()).encryptor().update

    # RFC 3610, 2.2. Flags: Adata in bit 6, (M - 2) / 2 in bits 5-3, L - 1 in bits 2-0.
    flags = 1 << 6 | (8 - 2) // 2 << 3 | 2 - 1
    mac = aes(bytes([flags]) + nonce + len(message).to_bytes(2, "big"))
    prefixed = len(associated).to_bytes(2, "big") + associated
    for block in blocks(prefixed) + blocks(message):
        mac = aes(xor(mac, block))

    # RFC 3610, 2.3. Block 0 of the key stream hides the tag, the others hide the message.
    def stream(counter: int) -> bytes:
        return aes(bytes([2 - 1]) + nonce + counter.to_bytes(2, "big"))

    numbered = enumerate(blocks(message), start=1)
    sealed = b"".join(xor(block, stream(counter)) for counter, block in numbered)
    return sealed[: len(message)], xor(mac, stream(0))[:8]


class EntryFields(NamedTuple):
    topic_id: int
    entry_id: int
    index: int  # type: ignore[assignment]  # as in vectors.py
    total: int
    payload: bytes


class PduFields(NamedTuple):
    """A PDU of clause 2 without its size. C is 0."""

    qos: int
    src: int
    dst: int
    seq: int
    hop: int
    entries: tuple[EntryFields, ...]


class SealedFields(NamedTuple):
    """What clause 11.1 makes a sealed PDU from. `pdu_size` is that of the sealed PDU."""

    pdu_size: int
    mode: int
    key: bytes
    kid: int
    t: int
    held: int
    pdu: PduFields
    is_pair_key: bool = False


def clear(pdu: PduFields, pdu_size: int) -> bytes:
    """An ordinary PDU of this size (clauses 2 to 5.2)."""
    n = len(pdu.entries)
    header = bytes([pdu.qos << 2, pdu.src, pdu.dst, pdu.seq, pdu.hop << 4 | n])
    nibbles = [entry.topic_id for entry in pdu.entries] + [0] * (n % 2)
    topic_ids = bytes(nibbles[at] << 4 | nibbles[at + 1] for at in range(0, len(nibbles), 2))
    entries = b"".join(
        struct.pack(">BBBH", e.entry_id, e.index, e.total, len(e.payload)) + e.payload
        for e in pdu.entries
    )
    body = header + topic_ids + entries
    if len(body) + 2 > pdu_size:
        raise ValueError("the entries do not fit")
    return with_crc(body.ljust(pdu_size - 2, b"\0"))


def subkey(key: bytes, mode: int, kid: int, src: int, pair_dst: int | None = None) -> bytes:
    """The key of one source (clause 11.2). A pair key has a dst, too."""
    info = b"sdrlinkd sealed" + bytes([mode, kid, src])
    if pair_dst is not None:
        info += bytes([pair_dst])
    return hkdf(key, b"", info, 16)


def seal(f: SealedFields) -> bytes:
    """A sealed PDU (clause 11.1)."""
    inner = clear(f.pdu, f.pdu_size - 14)
    header, plaintext = inner[:5], inner[5:-2]
    header = bytes([header[0] | 1]) + header[1:]
    kid_and_t = (f.kid << 30 | f.t).to_bytes(4, "big")
    nonce = bytes(8) + kid_and_t + bytes([f.pdu.seq])
    associated = header[:4] + bytes([header[4] & 0x0F]) + kid_and_t + bytes(2)
    key = subkey(f.key, f.mode, f.kid, f.pdu.src, f.pdu.dst if f.is_pair_key else None)
    if f.mode == SEAL:
        body, tag = ccm_seal(key, nonce, associated, plaintext)
    else:
        body = plaintext
        _, tag = ccm_seal(key, nonce, associated + body, b"")
    return with_crc(header + kid_and_t + f.held.to_bytes(2, "big") + body + tag)


def relay(sealed: bytes, delay: int) -> bytes:
    """The PDU as a relay forwards it, `delay` times 0.1 ms later (clause 11.3). Needs no key."""
    held = min(int.from_bytes(sealed[9:11], "big") + delay, 0xFFFF)
    hop_and_n = sealed[4] - 0x10
    return with_crc(
        sealed[:4] + bytes([hop_and_n]) + sealed[5:9] + held.to_bytes(2, "big") + sealed[11:-2]
    )


def fingerprint(key: bytes) -> bytes:
    """All 32 octets of a key's fingerprint (clause 6.12)."""
    return hashlib.sha256(b"sdrlinkd key fingerprint" + key).digest()


# CDR little endian header, then "hi".
HI = bytes([0x00, 0x01, 0x00, 0x00, 0x68, 0x69])
# STAMP: topic 1, entry id 0x2A, 1 234 567 us = 0x0012D687.
STAMP = bytes([1, 6, 1, 0x2A, 0x00, 0x12, 0xD6, 0x87])
# CONTACT: 8 + 2 * 9 = 26 octets. Ahead by 100 / 64 s at robot 2, by -3 / 64 s at robot 9.
NUMBER = bytes([0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8])
HEARD = ((2, bytes([0x11, 0x22, 0x33, 0x44]), 100), (9, bytes([0xDE, 0xAD, 0xBE, 0xEF]), -3))
CONTACT = (
    bytes([19, 26]) + NUMBER
    + b"".join(struct.pack(">B4si", node, first, ahead) for node, first, ahead in HEARD)
)  # fmt: skip
# KEY: kid 2 in bits 1-0, and bit 2 for the mode auth.
KEY = bytes([20, 5, 0b110]) + fingerprint(TEAM_KEY)[:4]

# Clause 10 has the octets of this PDU for a pdu_size of 32 = 46 - 14.
SIMPLE = PduFields(DEFAULT, 1, EVERYONE, 0, 1, (EntryFields(1, 0x2A, 0, 1, HI),))
SIMPLE_OCTETS = bytes.fromhex(
    "00 01 ff 00 11 10 2a 00 01 00 06 00 01 00 00 68 "
    "69 00 00 00 00 00 00 00 00 00 00 00 00 00 4c d0"
)
STAMPED = PduFields(
    LATENCY, 7, EVERYONE, 255, 4,
    (EntryFields(1, 0x2A, 0, 1, HI), EntryFields(CONTROL, 0, 0, 1, STAMP)),
)  # fmt: skip
MEETING = PduFields(DEFAULT, 1, EVERYONE, 33, 2, (EntryFields(CONTROL, 0, 0, 1, CONTACT),))

CLEAR_SIZE = 46
CLEAR_KEY = PduFields(DEFAULT, 1, EVERYONE, 0, 1, (EntryFields(CONTROL, 0, 0, 1, KEY),))

SEALED = {
    "v1_seal": SealedFields(46, SEAL, TEAM_KEY, 0, 1, 0, SIMPLE),
    "v2_auth": SealedFields(46, AUTH, TEAM_KEY, 0, 1, 0, SIMPLE),
    "v3_limits": SealedFields(64, SEAL, TEAM_KEY, 3, (1 << 30) - 1, 65535, STAMPED),
    "v4_relayed": SealedFields(
        64, SEAL, TEAM_KEY, 3, (1 << 30) - 1, 65535, STAMPED._replace(hop=3)
    ),
    "v5_pair_key": SealedFields(
        46, SEAL, PAIR_KEY, 0, 1, 0, SIMPLE._replace(dst=2), is_pair_key=True
    ),
    "v6_contact": SealedFields(80, SEAL, TEAM_KEY, 1, 0x00012345, 7, MEETING),
}

# Key, mode, kid, src, dst.
SUBKEYS = {
    "v8_subkey_seal_0_1": (TEAM_KEY, SEAL, 0, 1, None),
    "v8_subkey_auth_3_7": (TEAM_KEY, AUTH, 3, 7, None),
    "v8_subkey_pair_0_1_2": (PAIR_KEY, SEAL, 0, 1, 2),
}

# Sealed PDUs by line: header; kid, T and held; body; tag; CRC.
VECTORS: dict[str, bytes] = {
    "v1_seal": bytes.fromhex(
        "01 01 ff 00 11 "
        "00 00 00 01 00 00 "
        "fa e1 05 7f 27 75 15 9f 79 b4 4c ac 2a d9 ea 04 7c 69 dc 22 8f cc d9 c3 d4 "
        "be 47 73 5c 88 1c ad 49 "
        "c6 56"
    ),
    "v2_auth": bytes.fromhex(
        "01 01 ff 00 11 "
        "00 00 00 01 00 00 "
        "10 2a 00 01 00 06 00 01 00 00 68 69 00 00 00 00 00 00 00 00 00 00 00 00 00 "
        "34 fb e0 1c 97 8c 6b 4c "
        "fd 7c"
    ),
    "v3_limits": bytes.fromhex(
        "05 07 ff ff 42 "
        "ff ff ff ff ff ff "
        "36 9d 84 df 31 d7 8d 4a b5 ba 0d 8f bb 47 5d 21 1a f3 ee 0a 31 4a 94 54 f3 "
        "b4 d5 b9 9c 7d d4 54 e3 4c c1 24 ed 2b 45 1e 33 7f 1b "
        "37 81 4b 94 13 f7 1d 2f "
        "5a 8b"
    ),
    "v4_relayed": bytes.fromhex(
        "05 07 ff ff 32 "
        "ff ff ff ff ff ff "
        "36 9d 84 df 31 d7 8d 4a b5 ba 0d 8f bb 47 5d 21 1a f3 ee 0a 31 4a 94 54 f3 "
        "b4 d5 b9 9c 7d d4 54 e3 4c c1 24 ed 2b 45 1e 33 7f 1b "
        "37 81 4b 94 13 f7 1d 2f "
        "c7 36"
    ),
    "v5_pair_key": bytes.fromhex(
        "01 01 02 00 11 "
        "00 00 00 01 00 00 "
        "c5 02 12 95 08 13 be d1 22 f3 af 58 69 42 ba 4e 45 1e 9e f5 77 af 0b 96 51 "
        "5a 4d f5 a4 db 3b a3 c1 "
        "5f b2"
    ),
    "v6_contact": bytes.fromhex(
        "01 01 ff 21 21 "
        "40 01 23 45 00 07 "
        "9f ea 19 fb 2c 01 c0 95 05 b7 55 f3 a3 5e ed 5f 50 b0 0c 40 92 b2 ba d7 65 "
        "8a e5 32 63 1a 6a f4 cd 00 cd 69 6d 58 c5 2b b9 11 b0 cb ea 52 d8 e6 50 7f "
        "02 a9 ae 34 e6 8a 1b fc 7f "
        "b8 9d cb b9 19 41 9a a0 "
        "58 78"
    ),
    "v7_clear_key": bytes.fromhex(
        "00 01 ff 00 11 "
        "f0 00 00 01 00 07 14 05 06 3b 83 b6 a3 00 00 00 00 00 00 00 00 00 00 00 00 "
        "00 00 00 00 00 00 00 00 00 00 00 00 00 00 "
        "03 90"
    ),
    "v7_fingerprint": bytes.fromhex(
        "3b 83 b6 a3 b1 ba d4 a4 e7 e3 48 60 62 5a 40 1a 6a 3c 33 73 75 08 30 4a f8 "
        "fb 4e f7 9e 92 cb 55"
    ),
    "v8_subkey_seal_0_1": bytes.fromhex("55 7d b4 99 6b d5 dc 4a 10 15 3b f6 4d 7d b5 05"),
    "v8_subkey_auth_3_7": bytes.fromhex("58 3b 7d 97 18 59 e7 31 33 b8 b9 a5 ee 76 8a 19"),
    "v8_subkey_pair_0_1_2": bytes.fromhex("15 d5 29 08 1e 9a 89 0f 6c ab c8 2c 06 ce 18 f2"),
}


def compute() -> dict[str, bytes]:
    """All vectors, computed from their fields."""
    return (
        {name: seal(fields) for name, fields in SEALED.items()}
        | {"v7_clear_key": clear(CLEAR_KEY, CLEAR_SIZE), "v7_fingerprint": fingerprint(TEAM_KEY)}
        | {name: subkey(*inputs) for name, inputs in SUBKEYS.items()}
    )


def check_rfcs() -> None:
    """The parts against the vectors of their own documents."""
    assert crc16(b"123456789") == 0x31C3

    # RFC 3610, packet vectors 1 and 2: 31 and 32 octets, of which 8 stay clear.
    key = bytes(range(0xC0, 0xD0))
    packets = (
        (
            "00 00 00 03 02 01 00 a0 a1 a2 a3 a4 a5", 31,
            "58 8c 97 9a 61 c6 63 d2 f0 66 d0 c2 c0 f9 89 80 6d 5f 6b 61 da c3 84",
            "17 e8 d1 2c fd f9 26 e0",
        ),
        (
            "00 00 00 04 03 02 01 a0 a1 a2 a3 a4 a5", 32,
            "72 c9 1a 36 e1 35 f8 cf 29 1c a8 94 08 5c 87 e3 cc 15 c4 39 c9 e4 3a 3b",
            "a0 91 d5 6e 10 40 09 16",
        ),
    )  # fmt: skip
    for nonce, size, body, tag in packets:
        packet = bytes(range(size))
        sealed = ccm_seal(key, bytes.fromhex(nonce), packet[:8], packet[8:])
        assert sealed == (bytes.fromhex(body), bytes.fromhex(tag))

    # RFC 5869, test cases 1 and 3.
    info = bytes(range(0xF0, 0xFA))
    assert hkdf(bytes([0x0B]) * 22, bytes(range(13)), info, 42) == bytes.fromhex(
        "3cb25f25faacd57a90434f64d0362f2a2d2d0a90cf1a5a4c5db02d56ecc4c5bf34007208d5b887185865"
    )
    assert hkdf(bytes([0x0B]) * 22, b"", b"", 42) == bytes.fromhex(
        "8da4e775a563c18f715f802a063c5a31b8a11f5c5ee1879ec3454e5f3c738d2d9d201395faa4b61a96c8"
    )


def check() -> None:
    """The literals against what their fields give."""
    check_rfcs()
    assert clear(SIMPLE, 32) == SIMPLE_OCTETS
    assert compute() == VECTORS
    for name, fields in SEALED.items():
        assert len(VECTORS[name]) == fields.pdu_size
    assert VECTORS["v2_auth"][11:-10] == SIMPLE_OCTETS[5:-2]
    assert relay(VECTORS["v3_limits"], 1) == VECTORS["v4_relayed"]


if __name__ == "__main__":
    check()
    sys.stdout.write("OK\n")
