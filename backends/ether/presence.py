"""Whether the hub is there: a hub in real time says nothing while nobody sends."""

ASK_S = 0.25
"""The hub is asked this often."""
QUIET_S = 1.0
"""A hub that is silent for this long is gone."""


class Presence:
    """Notes when the hub was heard, and says when to ask it; times are monotonic, in s."""

    def __init__(self, now_s: float) -> None:
        self._heard_s = self._asked_s = now_s
        self.is_away = False
        """Whether the hub is gone."""

    def heard(self, now_s: float) -> None:
        """Note that the hub has said something."""
        self._heard_s = now_s

    def came_back(self) -> None:
        """Note that the hub serves this radio again."""
        self.is_away = False

    def has_gone(self, now_s: float) -> bool:
        """Whether the hub has been silent for too long, for the first time."""
        is_new = not self.is_away and now_s - self._heard_s > QUIET_S
        self.is_away = self.is_away or is_new
        return is_new

    def is_to_ask(self, now_s: float) -> bool:
        """Whether it is time to ask; then it is asked."""
        if now_s - self._asked_s < ASK_S:
            return False
        self._asked_s = now_s
        return True
