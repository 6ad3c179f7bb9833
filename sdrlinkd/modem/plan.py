"""When the next burst may leave, in samples."""

from backends import GAP


class AirPlan:
    """Keeps what is committed to the air below the lead plus one burst.

    `slack` is how much too late the one who waits may wake up, without a pause on the air.
    """

    def __init__(self, lead: int, slack: int = 0) -> None:
        self._lead = lead
        self._slack = slack
        self._free_at = 0

    def wait(self, now: int) -> int:
        """Samples until the next burst may be composed; 0: at once."""
        return max(0, self._free_at - now - self._lead - self._slack)

    def start(self, now: int) -> int:
        """Where a burst composed now begins."""
        return max(now + self._lead, self._free_at)

    def commit(self, start: int, n_samples: int) -> None:
        """A burst of `n_samples` will leave at `start`."""
        self._free_at = max(self._free_at, start + n_samples + GAP)
