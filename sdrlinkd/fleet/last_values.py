"""The last message of each topic, within a bound on memory."""

from collections import OrderedDict

from sdrlinkd.fleet.formats import Passed

MOST_BYTES = 64 << 20
OVERHEAD = 512


class LastValues:
    """The last message at each key; the key that was silent for longest goes first."""

    def __init__(self, most_bytes: int = MOST_BYTES) -> None:
        self._most_bytes = most_bytes
        self._values: OrderedDict[str, tuple[bytes, Passed, float]] = OrderedDict()
        self.n_bytes = 0

    def keep(self, key: str, payload: bytes, passed: Passed, at: float) -> None:
        """Keep a message that came at `at` instead of the one before."""
        self._drop(key)
        self._values[key] = payload, passed, at
        self.n_bytes += len(payload) + OVERHEAD
        while self.n_bytes > self._most_bytes:
            self._drop(next(iter(self._values)))

    def get(self, key: str) -> tuple[bytes, Passed, float] | None:
        """(payload, attachment, when it came) of the last message."""
        return self._values.get(key)

    def keys_at(self, prefix: str) -> list[str]:
        """All keys with a message that begin with `prefix`."""
        return [key for key in self._values if key.startswith(prefix)]

    def _drop(self, key: str) -> None:
        known = self._values.pop(key, None)
        if known is not None:
            self.n_bytes -= len(known[0]) + OVERHEAD
