"""The attachment of messages and calls of nodes on rmw_zenoh."""

import struct
from typing import NamedTuple

GID_SIZE = 16
_LAYOUT = struct.Struct(f"<qqB{GID_SIZE}s")


class Attachment(NamedTuple):
    """The number of a message of its sender, when it was sent in ns since 1970, and its gid."""

    number: int
    sent_ns: int
    gid: bytes

    def build(self) -> bytes:
        """As octets."""
        return _LAYOUT.pack(self.number, self.sent_ns, GID_SIZE, self.gid)

    @classmethod
    def parse(cls, octets: bytes | None) -> "Attachment | None":
        """The attachment in these octets; None if they are none."""
        if octets is None or len(octets) != _LAYOUT.size:
            return None
        number, sent_ns, size, gid = _LAYOUT.unpack(octets)
        return cls(number, sent_ns, gid) if size == GID_SIZE else None
