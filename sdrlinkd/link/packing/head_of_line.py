"""The messages that go next, while they are worth it."""

from sdrlinkd.link.packing.entry_ids import TopicEntryIds
from sdrlinkd.link.queue import Lane, Outbox, Outgoing


class HeadOfLine:
    """Drops heads whose lifespan has ended, fragments and all.

    Also those that receivers have given up: nothing of them was sent for `patience_s`.
    """

    def __init__(self, outbox: Outbox, entry_ids: TopicEntryIds, patience_s: float) -> None:
        self._outbox = outbox
        self._lives = outbox.lives
        self._entry_ids = entry_ids
        self._patience_s = patience_s

    def live(self, lane: Lane, now: float) -> Outgoing | None:
        """The lane's next message that may still go."""
        head = lane.current or (lane.waiting[0] if lane.waiting else None)
        while head is not None and (reason := self._in_vain(head, now)):
            if lane.current is None:
                self._outbox.withdraw_head(lane)
            else:
                self.abandon(lane, now)
            self._lives.drop(head, reason)
            head = lane.head
        return head

    def _in_vain(self, head: Outgoing, now: float) -> str:
        """Why no more of it need be sent; empty when it must."""
        if head.parity:
            return ""
        if head.expires_at <= now:
            return "tx_expired"
        # Nobody waits any more for the rest of what was begun.
        return "tx_stalled" if head.k and now > head.last_at + self._patience_s else ""

    def expire(self, now: float) -> None:
        """Look at all of them."""
        for level in tuple(self._outbox.levels):
            for lane in tuple(level.lanes):
                self.live(lane, now)

    def abandon(self, lane: Lane, now: float) -> None:
        """Send no more of the message the lane is in the middle of."""
        self._entry_ids.retire(self._outbox.withdraw_head(lane), now)
