"""What the topics of a plan share."""

from typing import NamedTuple

from sdrlinkd.link import ClassesParams, PduLinkTraits, Settled
from sdrlinkd.modem import Airtimes


class Setting(NamedTuple):
    """What all loads of a plan share; times in s.

    No burst is longer than `longest_s`; `host_s` is what the machines at both ends add at most.
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
        """Length in s of a burst of one PDU."""
        return self.airtimes.airtime_s(self.mcs, 1)

    @property
    def each_s(self) -> float:
        """Time in s that a further PDU takes in a burst."""
        return self.airtimes.airtime_s(self.mcs, 2) - self.one_s
