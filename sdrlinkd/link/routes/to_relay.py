"""A PDU of another robot that is to be forwarded, or may be."""

from typing import NamedTuple

from sdrlinkd.wire import Pdu


class PduToRelay(NamedTuple):
    """A PDU to be relayed; all its messages are worthless after `until`.

    Its ages are those at `at`. `is_ours_too`: the PDU is for this robot as well as for others.
    `number` is its PDU number, None if unknown. `is_spare`: it is relayed only if another robot
    names this one for it soon. `is_bare`: it holds only control records, so nobody answers for it.
    """

    pdu: Pdu
    data: bytes
    at: float
    until: float
    is_ours_too: bool
    number: int | None = None
    is_spare: bool = False
    is_bare: bool = False
