"""One PDU while it is being filled."""

from typing import NamedTuple

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.queue import Outgoing
from sdrlinkd.wire import PduBuilder

NO_DST = -1


class BuiltPdu(NamedTuple):
    """A PDU, the messages it carries an entry of, and the highest class inside."""

    data: bytes
    carried: list[Outgoing]
    qos: Qos


class Draft(PduBuilder):
    """A PDU in the making, with what its entries have in common and whose they are."""

    __slots__ = ("carried", "dst", "is_compressed", "qos")

    def __init__(self, pdu_size: int) -> None:
        super().__init__(pdu_size)
        self.carried: list[Outgoing] = []
        self.dst = NO_DST
        self.is_compressed = False
        self.qos = Qos.BULK

    def suits(self, message: Outgoing) -> bool:
        """Whether entries of `message` may join those that are there."""
        return self.dst == NO_DST or (
            self.dst == message.dst and self.is_compressed == message.is_compressed
        )

    def address(self, dst: int, qos: Qos) -> None:
        """Say where a PDU with nothing but records goes, and how urgently."""
        self.dst, self.qos = dst, qos

    def join(self, message: Outgoing) -> None:
        """An entry of `message` is in it, or what goes ahead of one."""
        self.dst = message.dst
        self.is_compressed = message.is_compressed
        if message.qos < self.qos:
            self.qos = message.qos
