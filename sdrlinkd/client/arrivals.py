"""The order of what a subscriber receives: messages kept for late subscribers, then newer ones."""

from collections import deque
from collections.abc import Sequence

from sdrlinkd.client.messages import LATE_PREFIX, Message, decode_in, new_late_topic


class Arrivals:
    """Requests the kept messages of topics, and puts a subscriber's messages in order.

    It has no socket. The kept messages come on a topic of the subscriber's own, and end with a
    frame of that topic alone. While they come, a newer message may come, too.
    """

    def __init__(self, filters: Sequence[bytes]) -> None:
        self._missing: dict[bytes, bytes] = {}
        """Filters whose kept messages are still to come, by request."""
        self.requests = [self.request(each) for each in filters]
        """Subscriptions that request the kept messages under each filter."""
        self._first: list[Message] = []
        self._ready: deque[Message] = deque()
        self._newest: dict[tuple[str, int | None], tuple[int, int]] = {}
        """Number and time of reception of the newest message, by topic."""

    @property
    def has_kept(self) -> bool:
        """Whether all kept messages have come."""
        return not self._missing

    def request(self, filter_: bytes) -> bytes:
        """A subscription that requests the kept messages under `filter_`."""
        topic = new_late_topic(filter_)
        self._missing[topic] = filter_
        return topic

    def forget(self, filter_: bytes) -> None:
        """Forget which messages under a filter have come."""
        for key in [key for key in self._newest if f"{key[0]}\0".encode().startswith(filter_)]:
            del self._newest[key]

    def take(self, frames: Sequence[bytes]) -> Message | None:
        """The message in `frames`, or None; it may have to wait for kept ones of its topic."""
        topic = frames[0]
        if topic.startswith(LATE_PREFIX):
            waits = topic in self._missing
        else:
            waits = any(topic.startswith(each) for each in self._missing.values())
        if not waits:
            return self.admit(frames)
        self.hold(frames)
        if not self._missing:
            self.begin()
        return None

    def hold(self, frames: Sequence[bytes]) -> None:
        """Hold a message that comes before the subscription is complete."""
        if (message := self._decode(frames)) is not None:
            self._first.append(message)

    def begin(self) -> None:
        """Note that the subscription is complete: the messages held are ready, in order.

        Kept messages that have not come by now are not waited for.
        """
        self._missing.clear()
        # The numbers of a topic rise; stop messages, which have none, stay where they came.
        numbered = sorted((each for each in self._first if each.number), key=_order)
        stops = [each for each in self._first if not each.number]
        seen = set[tuple[str, int | None, int]]()
        for message in numbered:
            named = (message.topic, message.via, message.number)
            if named not in seen and not self._is_known(message):
                seen.add(named)
                self._note(message)
                self._ready.append(message)
        self._ready.extend(stops)
        self._first.clear()

    def next(self) -> Message | None:
        """The next of the messages that were held."""
        return self._ready.popleft() if self._ready else None

    def admit(self, frames: Sequence[bytes]) -> Message | None:
        """The message in `frames`; None for an announcement, and for a repeat.

        After the daemon has restarted, it gives the kept messages again.
        """
        message = self._decode(frames)
        if message is None:
            return None
        if message.is_late and self._is_known(message):
            return None
        self._note(message)
        return message

    def _is_known(self, message: Message) -> bool:
        number, received_ns = self._newest.get((message.topic, message.via), (0, 0))
        return message.number <= number and message.received_ns <= received_ns

    def _decode(self, frames: Sequence[bytes]) -> Message | None:
        if not frames[0].startswith(LATE_PREFIX):
            return decode_in(frames)
        if len(frames) == 1:
            self._missing.pop(frames[0], None)
            return None
        return decode_in(frames[1:])

    def _note(self, message: Message) -> None:
        if message.number:
            self._newest[message.topic, message.via] = (message.number, message.received_ns)


def _order(message: Message) -> tuple[int, bool]:
    return message.number, not message.is_late
