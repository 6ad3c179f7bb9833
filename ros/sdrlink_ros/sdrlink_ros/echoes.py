"""Recognises messages that the bridge has published itself, where others publish, too."""

import hashlib
from collections import OrderedDict
from threading import Lock

MOST = 512
MOST_LATCHED = 1024
DIGEST_SIZE = 16


class Echoes:
    """The last messages published on topics to which the bridge may subscribe, too.

    ROS delivers them to the bridge's own subscription, and does not say who sent them. What was
    latched may come at any time, and again to each new subscription. Several threads use it.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self.watched: frozenset[str] = frozenset()
        """Topics to which the bridge subscribes."""
        self._sent: OrderedDict[tuple[str, bytes], int] = OrderedDict()
        self._latched: OrderedDict[tuple[str, bytes], None] = OrderedDict()

    def sent(self, topic: str, cdr: bytes, is_latched: bool = False) -> None:
        """Note a message just before it is published."""
        if not is_latched and topic not in self.watched:
            return
        key = topic, _digest(cdr[: len(cdr) // 4 * 4])
        with self._lock:
            if is_latched:
                self._latched[key] = None
                _shorten(self._latched, MOST_LATCHED)
            else:
                self._sent[key] = self._sent.pop(key, 0) + 1
                _shorten(self._sent, MOST)

    def is_own(self, topic: str, cdr: bytes) -> bool:
        """Whether a message that has just come was published here; each counts once."""
        with self._lock:
            if not self._sent and not self._latched:
                return False
            # DDS fills up to a multiple of four octets, with anything.
            for octets in (cdr[: len(cdr) // 4 * 4], cdr[:-4]):
                key = topic, _digest(octets)
                if key in self._latched:
                    return True
                if (n := self._sent.pop(key, 0)) > 1:
                    self._sent[key] = n - 1
                if n:
                    return True
        return False


def _digest(octets: bytes) -> bytes:
    return hashlib.blake2b(octets, digest_size=DIGEST_SIZE).digest()


def _shorten(
    kept: "OrderedDict[tuple[str, bytes], int] | OrderedDict[tuple[str, bytes], None]", most: int
) -> None:
    while len(kept) > most:
        kept.popitem(last=False)
