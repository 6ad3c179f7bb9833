"""The setting that all topics of a plan share."""

from typing import NamedTuple

from sdrlinkd.link import ClassesParams, PduLinkTraits, Settled
from sdrlinkd.modem import Airtimes
from sdrlinkd.plan.bounds import AccessBound


class Setting(NamedTuple):
    """The setting of a plan, common to all loads; times are in s.

    `longest_s` is the length of the longest burst, and `host_s` the largest latency that the
    machines at both ends add.
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
    has_numbers: bool = False
    """Whether messages that are too large for 255 fragments go in parts (the key `auto`)."""
    repeats: float = 0.0
    """Share of airtime that is left for repeats."""
    bounds: tuple[AccessBound, ...] = ()
    """The longest wait for the air, by class."""
    notes: tuple[str, ...] = ()
    """What a person should know about the assumptions of the plan, in sentences."""

    @property
    def one_s(self) -> float:
        """Length in s of a burst of one PDU."""
        return self.airtimes.airtime_s(self.mcs, 1)

    @property
    def each_s(self) -> float:
        """Time in s that each further PDU adds to a burst."""
        return self.airtimes.airtime_s(self.mcs, 2) - self.one_s
