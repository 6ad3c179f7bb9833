"""Recognises messages that the bridge has published itself, where others publish, too."""

from collections import OrderedDict
from threading import Lock

MOST = 512


class Echoes:
    """The last messages published on topics that the bridge also subscribes to.

    ROS delivers them to the bridge's own subscription, and does not say who sent them. Two threads
    use it.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self.watched: frozenset[str] = frozenset()
        """Topics to which the bridge subscribes."""
        self._sent: OrderedDict[tuple[str, bytes], int] = OrderedDict()

    def sent(self, topic: str, cdr: bytes) -> None:
        """Note a message just before it is published."""
        if topic not in self.watched:
            return
        key = topic, _rounded(cdr)
        with self._lock:
            self._sent[key] = self._sent.pop(key, 0) + 1
            while len(self._sent) > MOST:
                self._sent.popitem(last=False)

    def is_own(self, topic: str, cdr: bytes) -> bool:
        """Whether a message that has just come was published here; each counts once."""
        with self._lock:
            # DDS fills up to a multiple of four octets, with anything.
            for key in ((topic, _rounded(cdr)), (topic, cdr[:-4])):
                if (n := self._sent.pop(key, 0)) > 1:
                    self._sent[key] = n - 1
                if n:
                    return True
        return False


def _rounded(cdr: bytes) -> bytes:
    return cdr[: len(cdr) // 4 * 4]
