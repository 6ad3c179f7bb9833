"""Converts times of a hub, which may run on another computer."""

WINDOW_S = 2.0


class HubClock:
    """Converts times of the hub's monotonic clock to ours; on the same computer they are equal.

    The offset comes from the message with the shortest travel time in the last 2 to 4 s, so the
    crystals may differ. That travel time remains as an error: a millisecond or less on a local
    network.
    """

    def __init__(self, is_remote: bool) -> None:
        self._is_remote = is_remote
        self._before = self._least = 0
        self._until_ns: int | None = None

    def observe(self, hub_ns: int, now_ns: int) -> None:
        """Note that a message, sent at `hub_ns`, came at our time `now_ns`; in order."""
        offset = now_ns - hub_ns
        if self._until_ns is None or now_ns >= self._until_ns:
            self._before = offset if self._until_ns is None else self._least
            self._least = offset
            self._until_ns = now_ns + round(1e9 * WINDOW_S)
        self._least = min(self._least, offset)

    def local_ns(self, hub_ns: int) -> int:
        """Our monotonic time at the hub's time `hub_ns`."""
        return hub_ns + min(self._least, self._before) if self._is_remote else hub_ns
