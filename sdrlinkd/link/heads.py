"""The messages that go next, while they are worth it."""

from sdrlinkd.link.entry_ids import TopicEntryIds
from sdrlinkd.link.message import Lane, Outgoing
from sdrlinkd.link.outbox import Outbox


class Heads:
    """Withdraws heads whose lifespan has ended, fragments and all."""

    def __init__(self, outbox: Outbox, entry_ids: TopicEntryIds) -> None:
        self._outbox = outbox
        self._entry_ids = entry_ids
        self._expired: list[Outgoing] = []

    def live(self, lane: Lane, now: float) -> Outgoing | None:
        """The lane's next message that may still go."""
        head = lane.current or (lane.waiting[0] if lane.waiting else None)
        while head is not None and head.expires_at <= now and not head.parity:
            if lane.current is None:
                self._outbox.withdraw_head(lane)
            else:
                self.abandon(lane, now)
            self._expired.append(head)
            head = lane.head
        return head

    def expire(self, now: float) -> None:
        """Look at all of them; see `take_expired`."""
        for level in tuple(self._outbox.levels):
            for lane in tuple(level.lanes):
                self.live(lane, now)

    def take_expired(self) -> list[Outgoing]:
        """Messages withdrawn because their lifespan ended, since the last call."""
        expired, self._expired = self._expired, []
        return expired

    def abandon(self, lane: Lane, now: float) -> None:
        """Send no more of the message the lane is in the middle of."""
        self._entry_ids.retire(self._outbox.withdraw_head(lane), now)
