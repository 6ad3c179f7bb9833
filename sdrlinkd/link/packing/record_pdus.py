"""PDUs that hold only control records."""

from collections.abc import Callable, Sequence

from sdrlinkd.link.packing.bare_numbers import BareNumbers
from sdrlinkd.link.packing.draft import BuiltPdu, Draft
from sdrlinkd.link.packing.piggyback import PiggybackRecords
from sdrlinkd.link.qos import Qos
from sdrlinkd.wire import BROADCAST, Record, build_records


class RecordPdus:
    """Builds PDUs of `pdu_size` that hold only records; `finish` builds a draft under a number."""

    def __init__(
        self,
        pdu_size: int,
        piggyback: PiggybackRecords,
        bare: BareNumbers,
        finish: Callable[[Draft, int], BuiltPdu],
    ) -> None:
        self._pdu_size = pdu_size
        self._piggyback = piggyback
        self._bare = bare
        self._finish = finish
        self.made = 0
        """Number of PDUs made so far."""

    def with_only(self, records: Sequence[Record], number: int) -> list[BuiltPdu]:
        """PDU `number` with these records; empty if there are none."""
        return self._built(self._draft(records), number)

    def with_waiting(self, first: Sequence[Record], number: int, start: float) -> list[BuiltPdu]:
        """PDU `number`, for a burst at `start`; empty if there is nothing to tell.

        It has the records `first`, and as many as fit of those that wait.
        """
        draft = self._draft(first)
        self._piggyback.ride(draft, start, number)
        return self._built(draft, number)

    def _draft(self, records: Sequence[Record]) -> Draft:
        draft = Draft(self._pdu_size)
        for record in records:
            draft.add_record(build_records([record]))
        return draft

    def _built(self, draft: Draft, number: int) -> list[BuiltPdu]:
        if draft.is_empty:
            return []
        draft.address(BROADCAST, Qos.DEFAULT)
        self._bare.ride(draft, number)
        self._bare.note(number)
        self.made += 1
        return [self._finish(draft, number)]
