"""The order of what a subscriber receives: messages kept for late subscribers, then newer ones."""

from collections import deque
from collections.abc import Sequence

from sdrlinkd.client.messages import Message, decode_in


class Arrivals:
    """Puts a subscriber's first messages in order, and drops repeats, without a socket.

    The daemon publishes the messages that it kept to whoever has subscribed, marked as late. They
    also reach subscribers that came earlier and know them, and the first of them may arrive after a
    newer message.
    """

    def __init__(self) -> None:
        self._first: list[Message] = []
        self._ready: deque[Message] = deque()
        self._newest: dict[str, tuple[int, int]] = {}
        """Time of reception and number of the newest message, by topic: a burst has several."""

    def hold(self, frames: Sequence[bytes]) -> None:
        """Keep a message that arrived before the daemon confirmed the subscription."""
        if (message := decode_in(frames)) is not None:
            self._first.append(message)

    def begin(self) -> None:
        """Note that the daemon has confirmed: all messages that it had kept have arrived."""
        self._first.sort(key=lambda message: (*_when(message), message.is_late))
        self._ready.extend(each for each in self._first if self._is_new(each))
        self._first.clear()

    def next(self) -> Message | None:
        """The next of the messages that arrived early."""
        return self._ready.popleft() if self._ready else None

    def admit(self, frames: Sequence[bytes]) -> Message | None:
        """The message in `frames`; None for an announcement, and for a repeat for others."""
        message = decode_in(frames)
        return message if message is not None and self._is_new(message) else None

    def _is_new(self, message: Message) -> bool:
        newest = self._newest.get(message.topic, (0, 0))
        if message.is_late and _when(message) <= newest:
            return False
        self._newest[message.topic] = max(newest, _when(message))
        return True


def _when(message: Message) -> tuple[int, int]:
    return message.received_ns, message.number
