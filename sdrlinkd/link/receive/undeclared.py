"""Messages whose topic number has not been declared yet, held for a moment."""

from collections import OrderedDict
from typing import NamedTuple

from sdrlinkd.link.receive.ages import Origin

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


class UndeclaredMessages:
    """Holds messages of unknown topic numbers for HOLD_S, within a bound on memory."""

    def __init__(self) -> None:
        self._held: OrderedDict[int, tuple[float, Whole]] = OrderedDict()
        self._count = 0
        self.n_bytes = 0

    def __len__(self) -> int:
        return len(self._held)

    def hold(self, message: Whole, now: float) -> list[Whole]:
        """Hold a message; returns those that are given up to make room."""
        self._count += 1
        self._held[self._count] = (now + HOLD_S, message)
        self.n_bytes += _cost(message)
        given_up = []
        while self._is_full(message.src):
            given_up.append(self._take(self._oldest(message.src)))
        while self.n_bytes > MOST_BYTES:
            greedy = max({each.src for _, each in self._held.values()}, key=self._cost_of)
            given_up.append(self._take(self._oldest(greedy)))
        return given_up

    def of_source(self, src: int) -> list[Whole]:
        """Take out the messages of a source."""
        found = [key for key, (_, each) in self._held.items() if each.src == src]
        return [self._take(key) for key in found]

    def release(self, src: int, number: int) -> list[Whole]:
        """Take out the messages of a number that is known now, in their order."""
        found = [key for key, (_, each) in self._held.items() if each[:2] == (src, number)]
        return [self._take(key) for key in found]

    def expire(self, now: float) -> list[Whole]:
        """Take out the messages that have waited too long."""
        given_up = []
        while self._held:
            key, (until, _) = next(iter(self._held.items()))
            if now < until:
                break
            given_up.append(self._take(key))
        return given_up

    def _is_full(self, src: int) -> bool:
        held = sum(each.src == src for _, each in self._held.values())
        return held > MOST_MESSAGES or self._cost_of(src) > SOURCE_BYTES

    def _cost_of(self, src: int) -> int:
        return sum(_cost(each) for _, each in self._held.values() if each.src == src)

    def _oldest(self, src: int) -> int:
        return next(key for key, (_, each) in self._held.items() if each.src == src)

    def _take(self, key: int) -> Whole:
        _, message = self._held.pop(key)
        self.n_bytes -= _cost(message)
        return message


def _cost(message: Whole) -> int:
    return len(message.payload) + OVERHEAD
