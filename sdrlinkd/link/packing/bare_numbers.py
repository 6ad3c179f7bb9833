"""The PDUs that hold only control records, of which others need not miss anything."""

from sdrlinkd.link.packing.draft import Draft
from sdrlinkd.wire import bare, build_records

TIMES = 2
"""In how many PDUs with messages each is told; only these reach robots that hear relays."""


class BareNumbers:
    """Tells the numbers of PDUs without messages in the next PDUs."""

    def __init__(self) -> None:
        self.untold: dict[int, int] = {}
        """How often each is to be told yet, by number."""

    def note(self, number: int) -> None:
        """Note that PDU `number` holds only records."""
        self.untold[number] = TIMES

    def ride(self, draft: Draft, number: int) -> None:
        """Put a BARE record into PDU `number` if something is in its reach, and there is room."""
        told = bare(self.untold, number)
        if told is None:
            self.untold.clear()
            return
        if draft.add_record(build_records([told])):
            near, less = set(told.numbers(number)), bool(draft.carried)
            self.untold = {
                each: times - less
                for each, times in self.untold.items()
                if each in near and times > less
            }
