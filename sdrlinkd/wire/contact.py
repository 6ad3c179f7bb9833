"""The records CONTACT, KEY, LOST and FOUND: keys and their numbers (wire document, 6.11 ff.)."""

import struct
from typing import NamedTuple

CONTACT_NUMBER_SIZE = 8
CONTACT_PREFIX_SIZE = 4
"""Octets of another robot's number in a CONTACT."""
KEY_PREFIX_SIZE = 4
"""Octets of the fingerprint in a KEY record."""
AHEAD_UNIT_S = 1 / 64
_MET = struct.Struct(f">B{CONTACT_PREFIX_SIZE}si")
MET_SIZE = _MET.size
"""Octets of a CONTACT for each robot."""
CONTACT_OVERHEAD = 2 + CONTACT_NUMBER_SIZE
"""Octets of a CONTACT record that names no robot."""
_KEY = struct.Struct(f">B{KEY_PREFIX_SIZE}s")
KEY_SIZE = _KEY.size
_AUTH = 0x04
_LOST = struct.Struct(f">B{KEY_PREFIX_SIZE}s{CONTACT_NUMBER_SIZE}s")
LOST_SIZE = _LOST.size
_FOUND = struct.Struct(f">B{CONTACT_NUMBER_SIZE}sII")
FOUND_SIZE = _FOUND.size
_NO_AGE = 0xFFFFFFFF
_N_TICKS = 1 << 30


class Met(NamedTuple):
    """What a CONTACT says of robot `node`: the first octets of its number, and `ahead`.

    `ahead` is the least difference of the sender's key time to the T of that robot's PDUs, in units
    of AHEAD_UNIT_S (wire document, 6.11).
    """

    node: int
    number: bytes
    ahead: int


class Contact(NamedTuple):
    """CONTACT record: the sender's number, and the robots whose numbers it has heard."""

    number: bytes
    met: tuple[Met, ...] = ()


class KeyTold(NamedTuple):
    """KEY record: the key under which the sender seals; `is_auth`: in the mode auth."""

    kid: int
    is_auth: bool
    fingerprint: bytes


class LostNumbers(NamedTuple):
    """LOST record: the sender asks which of its numbers under a key others have heard."""

    kid: int
    fingerprint: bytes
    number: bytes
    """Drawn at random; the answer repeats it."""


class FoundNumbers(NamedTuple):
    """FOUND record: the answer to robot `node`, whose LOST had `number`."""

    node: int
    number: bytes
    kid: int
    newest: int
    """The newest T heard of that robot under the key; 0: none."""
    age: int | None
    """Time since the key was made, in 1/32 s; None: the sender does not trust its clock."""


def build_contact(contact: Contact) -> bytes:
    """The value of a CONTACT record. Raises ValueError or struct.error if a field does not fit."""
    if len(contact.number) != CONTACT_NUMBER_SIZE:
        raise ValueError(f"{contact} does not fit its record")
    return contact.number + b"".join(_MET.pack(*each) for each in contact.met)


def parse_contact(value: bytes) -> Contact:
    """The fields of a CONTACT value of sufficient length; an incomplete last robot is ignored."""
    n = (len(value) - CONTACT_NUMBER_SIZE) // _MET.size
    told = value[CONTACT_NUMBER_SIZE : CONTACT_NUMBER_SIZE + n * _MET.size]
    met = (Met(node, number, ahead) for node, number, ahead in _MET.iter_unpack(told))
    return Contact(value[:CONTACT_NUMBER_SIZE], tuple(met))


def build_key(told: KeyTold) -> bytes:
    """The value of a KEY record. Raises ValueError if a field is out of range."""
    if not 0 <= told.kid < 4 or len(told.fingerprint) != KEY_PREFIX_SIZE:
        raise ValueError(f"{told} does not fit its record")
    return _KEY.pack(told.kid | _AUTH * told.is_auth, told.fingerprint)


def parse_key(value: bytes) -> KeyTold:
    """The fields of a KEY value of sufficient length."""
    octet, fingerprint = _KEY.unpack_from(value)
    return KeyTold(octet & 0x03, bool(octet & _AUTH), fingerprint)


def build_lost(lost: LostNumbers) -> bytes:
    """The value of a LOST record. Raises ValueError if a field is out of range."""
    kid, fingerprint, number = lost
    if (
        not 0 <= kid < 4
        or len(fingerprint) != KEY_PREFIX_SIZE
        or len(number) != CONTACT_NUMBER_SIZE
    ):
        raise ValueError(f"{lost} does not fit its record")
    return _LOST.pack(*lost)


def parse_lost(value: bytes) -> LostNumbers:
    """The fields of a LOST value of sufficient length."""
    octet, fingerprint, number = _LOST.unpack_from(value)
    return LostNumbers(octet & 0x03, fingerprint, number)


def build_found(found: FoundNumbers) -> bytes:
    """The value of a FOUND record. Raises ValueError or struct.error if a field does not fit."""
    node, number, kid, newest, age = found
    if (
        len(number) != CONTACT_NUMBER_SIZE
        or not 0 <= kid < 4
        or not 0 <= newest < _N_TICKS
        or age == _NO_AGE
    ):
        raise ValueError(f"{found} does not fit its record")
    return _FOUND.pack(node, number, kid << 30 | newest, _NO_AGE if age is None else age)


def parse_found(value: bytes) -> FoundNumbers:
    """The fields of a FOUND value of sufficient length."""
    node, number, word, age = _FOUND.unpack_from(value)
    told = None if age == _NO_AGE else age
    return FoundNumbers(node, number, word >> 30, word & (_N_TICKS - 1), told)
