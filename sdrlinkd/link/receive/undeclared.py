"""Messages whose topic number has not been declared yet, held for a moment."""

from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

from sdrlinkd.link.receive.ages import Origin
from sdrlinkd.link.receive.delivered import UNNAMED_MESSAGE, MessageName

HOLD_S = 1.0
"""Time in s for which a message waits for its topic's declaration."""
SOURCE_BYTES = 12 << 20
"""Most memory in octets for one source: enough for a large message."""
MOST_BYTES = 48 << 20
"""Most memory in octets for all sources."""
MOST_MESSAGES = 64
"""Most messages of one source."""
OVERHEAD = 512


class Whole(NamedTuple):
    """A whole message, with all that its handover needs.

    `number` is its topic on the air, and `stamped` the (topic id, entry id) of its STAMP.
    """

    src: int
    number: int
    payload: bytes
    is_compressed: bool
    origin: Origin
    stamped: tuple[int, int]
    heard_at: float
    ended_at: float
    began_at: float
    hops_left: int
    snr_db: float | None
    name: MessageName = UNNAMED_MESSAGE
    is_proven: bool = True
    """Whether its source has proven to be alive."""
    to_one: bool = False
    """Whether it was sent to one robot."""
    is_sealed: bool = False
    """Whether all of it came sealed."""


@dataclass(slots=True)
class _Source:
    held: deque[tuple[float, Whole]] = field(default_factory=deque)
    """(time until which it waits, message), the oldest first."""
    n_bytes: int = 0


class UndeclaredMessages:
    """Holds messages of unknown topic numbers for HOLD_S, within bounds on memory."""

    def __init__(self) -> None:
        self._sources: dict[int, _Source] = {}
        self._count = self.n_bytes = 0

    def __len__(self) -> int:
        return self._count

    def hold(self, message: Whole, now: float) -> list[Whole]:
        """Hold a message; returns those that are given up to make room."""
        source = self._sources.setdefault(message.src, _Source())
        source.held.append((now + HOLD_S, message))
        self._note(source, message, 1)
        given_up = []
        while len(source.held) > MOST_MESSAGES or source.n_bytes > SOURCE_BYTES:
            given_up.append(self._take_oldest(source))
        while self.n_bytes > MOST_BYTES:
            greedy = max(self._sources.values(), key=lambda each: each.n_bytes)
            given_up.append(self._take_oldest(greedy))
        return given_up

    def of_source(self, src: int) -> list[Whole]:
        """Take out the messages of a source."""
        source = self._sources.get(src)
        return (
            [] if source is None else [self._take_oldest(source) for _ in range(len(source.held))]
        )

    def release(self, src: int, number: int) -> list[Whole]:
        """Take out the messages of a number that is known now, in their order."""
        source = self._sources.get(src)
        if source is None:
            return []
        released = [message for _, message in source.held if message.number == number]
        source.held = deque(each for each in source.held if each[1].number != number)
        for message in released:
            self._note(source, message, -1)
        return released

    def expire(self, now: float) -> list[Whole]:
        """Take out the messages that have waited too long."""
        given_up = []
        for src, source in list(self._sources.items()):
            while source.held and source.held[0][0] <= now:
                given_up.append(self._take_oldest(source))
            if not source.held:
                del self._sources[src]
        return given_up

    def _take_oldest(self, source: _Source) -> Whole:
        _, message = source.held.popleft()
        self._note(source, message, -1)
        return message

    def _note(self, source: _Source, message: Whole, sign: int) -> None:
        n_bytes = sign * (len(message.payload) + OVERHEAD)
        source.n_bytes += n_bytes
        self.n_bytes += n_bytes
        self._count += sign
