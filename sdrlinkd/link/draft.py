"""One PDU while it is being filled."""

from sdrlinkd.link.message import Outgoing
from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import PduBuilder

NO_DST = -1


class Draft(PduBuilder):
    """A PDU in the making, with what its entries have in common and whose they are."""

    __slots__ = ("carried", "dst", "qos")

    def __init__(self, pdu_size: int) -> None:
        super().__init__(pdu_size)
        self.carried: list[Outgoing] = []
        self.dst = NO_DST
        self.qos = Qos.BULK
