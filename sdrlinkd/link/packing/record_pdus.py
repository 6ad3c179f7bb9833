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

    def built(self, given: Sequence[Record], number: int, start: float | None) -> list[BuiltPdu]:
        """PDU `number` with the records `given`; empty if there is none.

        For a burst at `start`, it has as many as fit of those that wait, too.
        """
        draft = Draft(self._pdu_size)
        for record in given:
            draft.add_record(build_records([record]))
        if start is not None:
            self._piggyback.ride(draft, start, number)
        if draft.is_empty:
            return []
        draft.address(BROADCAST, Qos.DEFAULT)
        self._bare.ride(draft, number)
        self._bare.note(number)
        return [self._finish(draft, number)]
