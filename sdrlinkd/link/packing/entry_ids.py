"""Assigns entry ids to the messages of a topic (wire document, section 4.2)."""

from collections import Counter, deque
from collections.abc import Iterable
from random import Random

from sdrlinkd.link.queue import Level, Outgoing

# A receiver may hear the last fragment late (reordering, relays), so an id rests a little longer
# than the receiver waits for missing fragments.
REST_FACTOR = 1.25


class EntryIds:
    """The entry ids 0…255 of one topic in random order; a used id rests before it is used again.

    A receiver could join fragments of two messages that use one id within the reassembly timeout
    into a message that nobody sent. A single-entry message leaves nothing at the receiver, so its
    id is free again at once.
    """

    def __init__(self, rng: Random, rest_s: float) -> None:
        self.idle = deque(rng.sample(range(256), 256))
        """Free ids, the longest free first."""
        self.resting: deque[tuple[float, int]] = deque()
        """Resting ids as (time when free, id), in order of that time."""
        self._rest_s = rest_s
        self.n_taken = 0
        self.taken = [0] * 256
        """How often each id was taken."""

    def wake(self, now: float) -> None:
        """Free the ids that have rested for long enough at `now`."""
        while self.resting and self.resting[0][0] <= now:
            self.idle.append(self.resting.popleft()[1])

    def rest(self, entry_id: int, now: float) -> None:
        """Let an id rest, as the last fragment under it was sent at `now`."""
        self.resting.append((now + self._rest_s, entry_id))

    def hold(self, entry_id: int) -> bool:
        """Stop the rest of an id whose last fragment has not left; False if it was not resting."""
        for i, (_, resting) in enumerate(self.resting):
            if resting == entry_id:
                del self.resting[i]
                return True
        return False

    def rest_again(self, entry_id: int, now: float) -> None:
        """Let an id that rests or is free rest from `now` on."""
        if self.hold(entry_id):
            self.rest(entry_id, now)
        elif entry_id in self.idle:
            self.idle.remove(entry_id)
            self.rest(entry_id, now)

    def next_free(self) -> float:
        """Time at which an id will be free; −inf: now; +inf: not before an id starts to rest."""
        if self.idle:
            return float("-inf")
        return self.resting[0][0] if self.resting else float("inf")


class TopicEntryIds:
    """The entry ids of all topics: messages take ids and return them."""

    def __init__(self, rng: Random, rest_s: float) -> None:
        self._rng = rng
        self._rest_s = rest_s
        self._by_topic: dict[int, EntryIds] = {}
        self.starved: Counter[int] = Counter()
        """By topic id: how often the topic had to wait because none of its entry ids was free."""

    def take(self, message: Outgoing, now: float) -> int | None:
        """An entry id for `message`, or for its next part; None while none is free."""
        ids = self._by_topic.get(message.channel) or self._new(message.channel)
        if ids.resting:
            ids.wake(now)
        if ids.idle:
            if not ids.n_taken & 0xFF:
                # Before each round, so that equal messages differ in some octet: sequence numbers
                # come round after 256 PDUs, too.
                ids.idle.rotate(-1)
            ids.n_taken += 1
            entry_id = ids.idle.popleft()
            ids.taken[entry_id] += 1
            return entry_id
        self.starved[message.topic_id] += 1
        return None

    def retire(self, message: Outgoing, now: float) -> None:
        """Return the id of `message`, which has no more fragments: it rests, or is free at once."""
        ids = self._by_topic[message.channel]
        if message.rests_id:
            ids.rest(message.entry_id, now)
        else:
            ids.idle.append(message.entry_id)

    def times_taken(self, channel: int, entry_id: int) -> int:
        """How often an entry id of a topic was taken so far."""
        ids = self._by_topic.get(channel)
        return 0 if ids is None else ids.taken[entry_id]

    def rest_again(self, channel: int, entry_id: int, start: float) -> None:
        """Let an entry id rest anew, as a fragment under it is repeated at `start`."""
        ids = self._by_topic.get(channel)
        if ids is not None:
            ids.rest_again(entry_id, start)

    def not_left(self, messages: Iterable[Outgoing]) -> None:
        """Hold the ids of `messages`, whose fragments leave later than planned."""
        for message in messages:
            if not message.is_whole:
                ids = self._by_topic[message.channel]
                held = (each for each in message.ids if ids.hold(each))
                message.hold_ids((*message.held_ids, *held))

    def left(self, messages: Iterable[Outgoing], start: float) -> None:
        """Let the held ids of `messages` rest, as their fragments leave in a burst at `start`."""
        for message in messages:
            for entry_id in message.held_ids:
                self._by_topic[message.channel].rest(entry_id, start)
            message.hold_ids(())

    def next_free(self, message: Outgoing) -> float:
        """Time at which an entry id is free for `message`; −inf: now."""
        if message.is_whole:
            return float("-inf")
        ids = self._by_topic.get(message.channel) or self._new(message.channel)
        return ids.next_free()

    def next_free_of(self, levels: Iterable[Level]) -> float:
        """Time at which a message of any level may begin or go on; −inf: now."""
        soonest = float("inf")
        for level in levels:
            for lane in level.lanes:
                head = lane.head
                if head is None:
                    continue
                needs_id = lane.current is None or head.needs_id
                free_at = self.next_free(head) if needs_id else float("-inf")
                if free_at == float("-inf"):
                    return free_at
                soonest = min(soonest, free_at)
        return soonest

    def _new(self, topic_id: int) -> EntryIds:
        ids = self._by_topic[topic_id] = EntryIds(self._rng, self._rest_s)
        return ids
