"""The messages that go next, while they are worth it."""

from sdrlinkd.link.packing.entry_ids import TopicEntryIds
from sdrlinkd.link.queue import Lane, Outbox, Outgoing


class HeadOfLine:
    """Drops heads that are in vain, fragments and all: see `Outgoing.in_vain`.

    Only what stands first in a lane is looked at. What waits behind it is looked at when its turn
    comes, so the cost does not grow with the queue.
    """

    def __init__(self, outbox: Outbox, entry_ids: TopicEntryIds, patience_s: float) -> None:
        self._outbox = outbox
        self._lives = outbox.lives
        self._entry_ids = entry_ids
        self._patience_s = patience_s

    def next_live(self, lane: Lane, now: float) -> Outgoing | None:
        """The lane's next message that may still go; those before it are dropped."""
        head = lane.head
        while head is not None and (reason := head.in_vain(now, self._patience_s)):
            if lane.current is None:
                self._outbox.withdraw_head(lane)
            else:
                self.abandon(lane, now)
            self._lives.drop(head, reason)
            head = lane.head
        return head

    def expire(self, now: float) -> None:
        """Look at the heads of all lanes."""
        for level in tuple(self._outbox.levels):
            for lane in tuple(level.lanes):
                self.next_live(lane, now)

    def abandon(self, lane: Lane, now: float) -> None:
        """Send no more of the message that `lane` is in the middle of."""
        self._entry_ids.retire(self._outbox.withdraw_head(lane), now)
