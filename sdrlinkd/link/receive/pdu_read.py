"""An admitted PDU with its fields, its records, and the ages in it."""

import struct
from typing import NamedTuple

from sdrlinkd.errors import PduError
from sdrlinkd.link.params import LinkParams
from sdrlinkd.link.receive.door import Admitted
from sdrlinkd.link.receive.events import Event, PduHeard, RecordHeard
from sdrlinkd.wire import (
    Beacon,
    Clock,
    Contact,
    ControlEntries,
    Frame,
    Pdu,
    Receipt,
    Record,
    RegistryDigest,
    Stamp,
    TopicPiece,
    Wanted,
    aged,
    nearest_number,
    numbered,
    parse,
    read_control_entries,
    with_topic,
)

_FAR = (Contact, Receipt, RegistryDigest, TopicPiece, Wanted)
"""Records that count in PDUs that a relay forwarded."""
_NO_CONTROL = ControlEntries([], 0, 0)


class PduRead(NamedTuple):
    """A PDU that could be read.

    `is_relayed`: others than its source vouch for its times, or it was repeated; `is_forwarded`: a
    relay has sent it.
    """

    pdu: Pdu
    control: ControlEntries
    records: list[Record]
    is_relayed: bool
    is_forwarded: bool

    @property
    def has_messages(self) -> bool:
        """Whether it holds more than control records."""
        return self.control.n_entries < len(self.pdu.entries)

    @property
    def is_far(self) -> bool:
        """Whether there is something in it for robots that hear relays only."""
        return self.has_messages or any(isinstance(record, _FAR) for record in self.records)

    @property
    def stamps(self) -> list[Stamp]:
        """The ages in the PDU."""
        return [record for record in self.records if isinstance(record, Stamp)]

    @property
    def told(self) -> int | None:
        """The number of this PDU, if it tells one."""
        for record in self.records:
            if isinstance(record, Beacon | Clock) and record.pdu_number is not None:
                return nearest_number(record.pdu_number, self.pdu.seq)
        return None


class PduReader:
    """Reads PDUs that were admitted, in the clear or from inside sealed ones."""

    def __init__(
        self, params: LinkParams, clear_size: int, *, has_control: bool, has_numbers: bool
    ) -> None:
        self._inner_size = params.pdu_size
        self._clear_size = clear_size
        self._hop_limit = params.hop_limit
        self._has_control = has_control
        self._has_numbers = has_numbers

    def read(self, admitted: Admitted, later_s: float | None = None) -> PduRead:
        """The fields of a PDU that was sent first `later_s` before; None: as its source says.

        If the source does not say it, only ages grow. Raises PduError.
        """
        is_opened, is_told = admitted.ticks is not None, later_s is None
        if later_s is None:
            # What is told of a sealed PDU is in its ages since it was opened.
            later_s = 0.0 if is_opened else admitted.at - admitted.first_at
        size = self._inner_size if is_opened else self._clear_size
        data = admitted.data
        pdu = parse(data, size, is_intact=is_opened)
        if later_s > 0 and self._has_control:
            try:
                pdu = parse(
                    aged(data, round(1e6 * later_s), only_ages=not is_told), size, is_intact=True
                )
            except (IndexError, struct.error):
                raise PduError("rx_entry", "entries that contradict themselves") from None
        control = read_control_entries(pdu) if self._has_control else _NO_CONTROL
        records = control.records
        if self._has_numbers:
            pdu, records = numbered(pdu), [with_topic(record) for record in records]
        is_forwarded = pdu.hop < self._hop_limit
        return PduRead(pdu, control, records, is_forwarded or admitted.is_held, is_forwarded)

    def glance(self, admitted: Admitted) -> list[Event]:
        """The events that follow from the presence of a PDU whose source is not proven."""
        try:
            pdu, _, records, is_relayed, _ = self.read(admitted)
        except PduError:
            return []
        events: list[Event] = [PduHeard(pdu, [], admitted.at, is_relayed, admitted.signal)]
        if not is_relayed:
            events += [
                RecordHeard(pdu.src, record, admitted.at)
                for record in records
                if isinstance(record, Beacon)
                or (isinstance(record, Frame) and admitted.may_schedule)
            ]
        return events
