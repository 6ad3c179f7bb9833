"""Which entry id the next message of a topic gets (wire document, section 4.2)."""

from collections import Counter, deque
from collections.abc import Iterable
from random import Random

from sdrlinkd.link.queue import Outgoing

# A receiver may hear the last fragment late (reordering, relays), so ids rest a little longer
# than it waits for missing ones.
REST_FACTOR = 1.25


class EntryIds:
    """A shuffled permutation of 0…255 for one topic, in which a used id rests before its return.

    Two fragmented messages under one id within the reassembly timeout could be joined into one
    that nobody sent. A single-entry message leaves nothing behind at the receiver, so its id is
    free again at once.
    """

    def __init__(self, rng: Random, rest_s: float) -> None:
        self.idle = deque(rng.sample(range(256), 256))
        """Ids that are free, the longest free first."""
        self.resting: deque[tuple[float, int]] = deque()
        """(until when, id), in the order in which they will be free."""
        self._rest_s = rest_s

    def wake(self, now: float) -> None:
        """Make ids free that have rested for long enough at `now`."""
        while self.resting and self.resting[0][0] <= now:
            self.idle.append(self.resting.popleft()[1])

    def rest(self, entry_id: int, now: float) -> None:
        """The last fragment under the id went at `now`."""
        self.resting.append((now + self._rest_s, entry_id))

    def hold(self, entry_id: int) -> bool:
        """Its last fragment has not left after all; whether it was at rest. See `rest`."""
        for i, (_, resting) in enumerate(self.resting):
            if resting == entry_id:
                del self.resting[i]
                return True
        return False

    def next_free(self) -> float:
        """When an id will be free: −inf at once, +inf never until one comes back."""
        if self.idle:
            return float("-inf")
        return self.resting[0][0] if self.resting else float("inf")


class TopicEntryIds:
    """The ids of all topics, as messages take and leave them."""

    def __init__(self, rng: Random, rest_s: float) -> None:
        self._rng = rng
        self._rest_s = rest_s
        self._by_topic: dict[int, EntryIds] = {}
        self.starved: Counter[int] = Counter()
        """How often a topic had to wait because all its ids were at rest."""

    def take(self, topic_id: int, now: float) -> int | None:
        """An id for the topic's next message; None while none is free."""
        ids = self._by_topic.get(topic_id) or self._new(topic_id)
        if ids.resting:
            ids.wake(now)
        if ids.idle:
            return ids.idle.popleft()
        self.starved[topic_id] += 1
        return None

    def retire(self, message: Outgoing, now: float) -> None:
        """Let its id rest, or go on at once: no more fragments of `message` will be made."""
        ids = self._by_topic[message.topic_id]
        if message.rests_id:
            ids.rest(message.entry_id, now)
        else:
            ids.idle.append(message.entry_id)

    def not_left(self, messages: Iterable[Outgoing]) -> None:
        """Keep the ids of `messages`: fragments of them leave later than they were made for."""
        for message in messages:
            if not message.is_whole and not message.is_held:
                message.hold_id(self._by_topic[message.topic_id].hold(message.entry_id))

    def left(self, messages: Iterable[Outgoing], start: float) -> None:
        """Let ids rest whose fragments were held back, and leave in a burst at `start`."""
        for message in messages:
            if message.is_held:
                message.hold_id(False)
                self._by_topic[message.topic_id].rest(message.entry_id, start)

    def next_free(self, message: Outgoing) -> float:
        """When `message` can have one; −inf: at once."""
        if message.is_whole:
            return float("-inf")
        ids = self._by_topic.get(message.topic_id) or self._new(message.topic_id)
        return ids.next_free()

    def _new(self, topic_id: int) -> EntryIds:
        ids = self._by_topic[topic_id] = EntryIds(self._rng, self._rest_s)
        return ids
