"""How a large message is divided into parts (wire document, section 4.4)."""

from typing import NamedTuple

from sdrlinkd.wire import Part, build_part


class Parting(NamedTuple):
    """How a large message is divided: octets of a part, and what each part says.

    `number` is the topic's octet, and `serial` counts the topic's large messages modulo 2^16.
    """

    size: int
    number: int
    serial: int
    wants_stamp: bool

    def count_of(self, payload: bytes) -> int:
        """How many parts a message has."""
        return -(-len(payload) // self.size)

    def part(self, payload: bytes, left: int) -> bytes:
        """The octets of the part after which `left` - 1 others follow."""
        n = self.count_of(payload)
        at = n - left
        data = payload[at * self.size : (at + 1) * self.size]
        return build_part(Part(self.number, self.serial, at, n, data))
