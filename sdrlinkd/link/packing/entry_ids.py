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
        self._idle = deque(rng.sample(range(256), 256))
        self._resting: deque[tuple[float, int]] = deque()
        self._rest_s = rest_s

    def take(self, now: float) -> int | None:
        """An id that is free at `now`, or None when all are at rest."""
        while self._resting and self._resting[0][0] <= now:
            self._idle.append(self._resting.popleft()[1])
        return self._idle.popleft() if self._idle else None

    def give_back(self, entry_id: int) -> None:
        """The id was used for a message in one entry, or not at all."""
        self._idle.append(entry_id)

    def rest(self, entry_id: int, now: float) -> None:
        """The last fragment under the id went at `now`."""
        self._resting.append((now + self._rest_s, entry_id))

    def hold(self, entry_id: int) -> bool:
        """Its last fragment has not left after all; whether it was at rest. See `rest`."""
        for i, (_, resting) in enumerate(self._resting):
            if resting == entry_id:
                del self._resting[i]
                return True
        return False

    def next_free(self) -> float:
        """When `take` will succeed: −inf at once, +inf never until an id comes back."""
        if self._idle:
            return float("-inf")
        return self._resting[0][0] if self._resting else float("inf")


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
        entry_id = self._of(topic_id).take(now)
        if entry_id is None:
            self.starved[topic_id] += 1
        return entry_id

    def retire(self, message: Outgoing, now: float) -> None:
        """No more fragments of it will be made."""
        ids = self._of(message.topic_id)
        if message.rests_id:
            ids.rest(message.entry_id, now)
        else:
            ids.give_back(message.entry_id)

    def not_left(self, messages: Iterable[Outgoing]) -> None:
        """Fragments of these will leave later than they were made for: their ids must wait, too."""
        for message in messages:
            if not message.is_whole and not message.is_held:
                message.hold_id(self._of(message.topic_id).hold(message.entry_id))

    def left(self, messages: Iterable[Outgoing], start: float) -> None:
        """Fragments that were held back leave in a burst at `start`: their ids rest from now on."""
        for message in messages:
            if message.is_held:
                message.hold_id(False)
                self._of(message.topic_id).rest(message.entry_id, start)

    def next_free(self, message: Outgoing) -> float:
        """When it can have one; −inf: at once."""
        return float("-inf") if message.is_whole else self._of(message.topic_id).next_free()

    def _of(self, topic_id: int) -> EntryIds:
        ids = self._by_topic.get(topic_id)
        if ids is None:
            ids = self._by_topic[topic_id] = EntryIds(self._rng, self._rest_s)
        return ids
