"""What the topics of a plan share."""

from typing import NamedTuple

from sdrlinkd.link import ClassesParams, PduLinkTraits, Settled
from sdrlinkd.modem import Airtimes


class Setting(NamedTuple):
    """What the loads share; times in s.

    `longest_s`: no burst is longer; `host_s`: what the machines at both ends add at most.
    """

    airtimes: Airtimes
    pdu_size: int
    mcs: int
    longest_s: float
    classes: ClassesParams
    robots: int
    settled: Settled
    traits: PduLinkTraits
    host_s: float
    notes: tuple[str, ...] = ()
    """What a person should know of how this was planned."""

    @property
    def one_s(self) -> float:
        """A burst of one PDU."""
        return self.airtimes.airtime_s(self.mcs, 1)

    @property
    def each_s(self) -> float:
        """A further PDU in a burst."""
        return self.airtimes.airtime_s(self.mcs, 2) - self.one_s
