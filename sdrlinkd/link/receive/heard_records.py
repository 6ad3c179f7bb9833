"""What becomes of the control records in a PDU that is for this robot."""

from collections.abc import Iterable

from sdrlinkd.link.receive.completion import Completion
from sdrlinkd.link.receive.door import Admitted
from sdrlinkd.link.receive.events import Event, RecordHeard
from sdrlinkd.link.receive.neighbors import Neighbor
from sdrlinkd.link.topics import HeardTopics
from sdrlinkd.wire import (
    Beacon,
    Contact,
    FoundNumbers,
    Frame,
    Grant,
    KeyTold,
    LinkReport,
    LostNumbers,
    Parity,
    Pdu,
    RatesAsked,
    Receipt,
    Record,
    RegistryDigest,
    Stamp,
    TopicPiece,
    Want,
    Wanted,
)

_ELSEWHERE = (Parity, Stamp, Contact, KeyTold, LostNumbers, FoundNumbers)
"""Records that others take: the inbox, and sealing."""

RECIPROCAL_DB = 15.0
"""Largest difference in dB between the two directions that is believed: powers and noise differ."""


class HeardRecords:
    """Takes records about the source itself, and passes on those that other parts need."""

    def __init__(self, own_id: int, topics: HeardTopics, completion: Completion) -> None:
        self._own_id = own_id
        self._topics = topics
        self._completion = completion

    def take(
        self,
        pdu: Pdu,
        admitted: Admitted,
        neighbor: Neighbor,
        records: Iterable[Record],
        is_relayed: bool,
        now: float,
        events: list[Event],
    ) -> None:
        """Take the records of a PDU, in order.

        What a source that is not proven says about others is not used, nor are its clocks.
        """
        src, at = pdu.src, admitted.at
        for record in records:
            if isinstance(record, Beacon):
                if not is_relayed and not admitted.was_seen:
                    events.append(RecordHeard(src, record, at))
            elif isinstance(record, RegistryDigest):
                neighbor.take_digest(record)
            elif isinstance(record, TopicPiece):
                if self._topics.take(src, record):
                    self._completion.declared(src, record.number, now, events)
            elif isinstance(record, Frame | Grant):
                if not is_relayed and not admitted.was_seen and admitted.may_schedule:
                    events.append(RecordHeard(src, record, at))
            elif not admitted.is_proven or isinstance(record, _ELSEWHERE):
                continue
            elif isinstance(record, Receipt):
                if self._own_id in (pdu.dst, record.node):
                    events.append(RecordHeard(src, record, at))
            elif isinstance(record, Wanted | RatesAsked):
                if record.node == self._own_id:
                    events.append(RecordHeard(src, record, at))
            elif not is_relayed:
                if isinstance(record, LinkReport):
                    record = _plausible(record, neighbor.mean_snr_db)
                events.append(RecordHeard(src, record, at))

    def take_wants(
        self, src: int, admitted: Admitted, records: Iterable[Record], events: list[Event]
    ) -> None:
        """Take what robot `src` wants from a PDU to another robot: it concerns all who share the
        air.
        """
        wants = (each for each in records if isinstance(each, Want) and admitted.is_proven)
        events += (RecordHeard(src, want, admitted.at) for want in wants)


def _plausible(report: LinkReport, snr_db: float | None) -> LinkReport:
    """A report of a robot that we hear at `snr_db`: both ways differ by RECIPROCAL_DB at most.

    Otherwise a single false report would slow down, or speed up, what we send.
    """
    if snr_db is None:
        return report
    low, high = (round(4 * (snr_db + off)) for off in (-RECIPROCAL_DB, RECIPROCAL_DB))
    return report._replace(snr_quarter_db=min(max(report.snr_quarter_db, low), high))
