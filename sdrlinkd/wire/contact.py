"""The records CONTACT and KEY, about who holds a key (wire document, 6.11 and 6.12)."""

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
