"""A PDU of another robot that is to be forwarded, or may be."""

from typing import NamedTuple

from sdrlinkd.wire import HOP, Pdu, relayed


class PduToRelay(NamedTuple):
    """A PDU to be relayed; all its messages are worthless after `until`.

    Its ages are those at `at`. `is_ours_too`: the PDU is for this robot as well as for others.
    `number` is its PDU number, None if unknown. `is_spare`: it is relayed only if another robot
    names this one for it soon. `is_bare`: it holds only control records, so nobody answers for it.
    `is_passed_on`: another robot has forwarded it, and this is how that one did.
    """

    pdu: Pdu
    data: bytes
    at: float
    until: float
    is_ours_too: bool
    number: int | None = None
    is_spare: bool = False
    is_bare: bool = False
    is_passed_on: bool = False

    def passed_on(self) -> "PduToRelay":
        """The same PDU, with one hop less. Raises ValueError if it has none left."""
        # Its ages are still those at `at`.
        data = relayed(self.data, 0, has_control=False)
        pdu = self.pdu._replace(hop=data[HOP] >> 4)
        return self._replace(pdu=pdu, data=data, is_passed_on=True)
