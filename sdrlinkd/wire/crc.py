"""CRC-16/XMODEM, the checksum of a PDU (wire document, section 5.2)."""

from fastcrc import crc16 as _crc16

crc16 = _crc16.xmodem
"""The CRC of the octets given, from 0 to 65535; over octets and their own CRC it is 0."""
