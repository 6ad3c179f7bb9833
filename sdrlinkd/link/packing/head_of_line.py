"""Keeps only messages at the head of each lane that are still worth sending."""

from sdrlinkd.link.packing.entry_ids import TopicEntryIds
from sdrlinkd.link.queue import Lane, Outbox, Outgoing


class HeadOfLine:
    """Drops head-of-line messages that are pointless to send, with all fragments.

    `Outgoing.in_vain` defines pointless. Only the first message of a lane is checked, so the cost
    does not grow with the queue; later messages are checked when they become the head.
    """

    def __init__(self, outbox: Outbox, entry_ids: TopicEntryIds, patience_s: float) -> None:
        self._outbox = outbox
        self._lives = outbox.lives
        self._entry_ids = entry_ids
        self._patience_s = patience_s

    def next_live(self, lane: Lane, now: float) -> Outgoing | None:
        """The lane's next message that is worth sending; the messages before it are dropped."""
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
        """Check the heads of all lanes at `now`, and drop those that are pointless to send."""
        for level in tuple(self._outbox.levels):
            for lane in tuple(level.lanes):
                self.next_live(lane, now)

    def abandon(self, lane: Lane, now: float) -> None:
        """Send no more fragments of the message that `lane` has begun."""
        message = self._outbox.withdraw_head(lane)
        if not message.needs_id:  # between two parts, it has none
            self._entry_ids.retire(message, now)
