"""Plans when the next burst may leave, in samples."""

from backends import GAP, TxWindows

EASE = 512
"""Number of bursts in time after which most of an increase of the lead has decayed."""


class AirPlan:
    """Keeps the airtime committed in advance below `lead + ahead` plus one burst.

    A burst starts at least `lead` after it is composed. It is composed at most `lead + ahead`
    before the end of the burst before it.
    """

    def __init__(self, lead: int, ahead: int = 0) -> None:
        self._lead = self._least = lead
        self._ahead = ahead
        self._free_at = 0

    def wait(self, now: int) -> int:
        """Samples until the next burst may be composed; 0: at once."""
        return max(0, self._free_at - now - self._lead - self._ahead)

    def start(self, now: int) -> int:
        """Index at which a burst composed now begins."""
        return max(now + self._lead, self._free_at)

    def was_late(self) -> None:
        """Increase the lead, within what `ahead` allows, as a burst was late."""
        added = self._lead - self._least
        self._lead += max(0, min(self._lead, self._ahead - added)) // 2

    def was_in_time(self) -> None:
        """Decrease the lead a little, as a burst was in time."""
        self._lead -= (self._lead - self._least + EASE - 1) // EASE

    def commit(self, start: int, n_samples: int) -> None:
        """Note that a burst of `n_samples` will leave at `start`."""
        self._free_at = max(self._free_at, start + n_samples + GAP)


class TxWindowPlan(AirPlan):
    """Plans bursts for a radio that sends in TX windows: in the open window, or in the next."""

    def __init__(self, lead: int, ahead: int, tx_windows: TxWindows, rate_hz: float) -> None:
        super().__init__(lead, ahead)
        self._follow, self._pause, self._longest = (round(each * rate_hz) for each in tx_windows)
        self._begun_at = 0
        # No TX window is open before the first burst.
        self._free_at = -self._pause

    def wait(self, now: int) -> int:
        """Samples until the next burst may be composed; 0: at once."""
        if self._goes_on(now):
            return super().wait(now)
        return max(0, self._free_at + self._pause - now - self._lead)

    def start(self, now: int) -> int:
        """Index at which a burst composed now begins."""
        if self._goes_on(now):
            return self._free_at
        return max(now + self._lead, self._free_at + self._pause)

    def commit(self, start: int, n_samples: int) -> None:
        """Note that a burst of `n_samples` will leave at `start`."""
        if start > self._free_at:
            self._begun_at = start
        super().commit(start, n_samples)

    def _goes_on(self, now: int) -> bool:
        is_short = self._free_at - self._begun_at < self._longest
        return is_short and now + self._follow <= self._free_at
