"""`none`: an air of our own."""

from math import inf

from sdrlinkd.link.access.base import BusyChannel, Slot, Wish
from sdrlinkd.link.access.sightings import Sightings

DEAF_S = 0.02
"""A radio that is deaf for longer than most bursts last is no radio for several without turns."""


class Free(BusyChannel):
    """Sends whenever there is something to send.

    `deaf_s`: then it hears nothing for longer; `gap_s` stays free between two bursts, and `pause_s`
    after it has sent for `tx_window_s`. `is_alone`: nobody else should be on this air.
    """

    def __init__(
        self,
        deaf_s: float = 0.0,
        gap_s: float = 0.0,
        tx_window_s: float = inf,
        pause_s: float = 0.0,
        is_alone: bool = False,
    ) -> None:
        super().__init__()
        self._deaf_s = deaf_s
        self._gap_s = gap_s
        self._tx_windows = tx_window_s, pause_s
        self._is_alone = is_alone
        self._others = Sightings()

    @property
    def state(self) -> str:
        """The policy's name, for people."""
        return "none"

    def slot(self, wish: Wish) -> Slot | None:
        """A slot where it is wanted, at once."""
        return Slot(wish.earliest)

    def carries(self, burst_s: float) -> float:
        """All of the air but gaps, and what the radio listens between two TX windows."""
        tx_window_s, pause_s = self._tx_windows
        listens = pause_s / (tx_window_s + pause_s) if tx_window_s < inf else 0.0
        gaps = self._gap_s / (burst_s + self._gap_s) if self._gap_s else 0.0
        return (1 - gaps) * (1 - listens)

    def sent(self, end: float, src: int | None) -> None:
        """Ignore it: nothing here depends on when our bursts end."""

    def heard(self, src: int, at: float, is_relayed: bool) -> None:
        """Remember that somebody else is on this air after all."""
        if self._is_alone and not is_relayed:
            self._others.add(src, at)

    def notices(self, now: float) -> list[str]:
        """Two that are deaf so long lose most of each other's bursts."""
        notices = super().notices(now)
        others = self._others.lately(now)
        if others and not notices:
            who = ", ".join(map(str, others))
            notices.append(
                f"robot {who} shares this channel, but access.nodes lists no other robot: "
                "simultaneous bursts collide; list all robots in access.nodes at all of them"
            )
        if self._deaf_s < DEAF_S:
            return notices
        notice = (
            "for each burst it sends, this radio hears nothing for "
            f"{self._deaf_s * 1e3:.3g} ms: if other robots send, too, set "
            'access.policy = "tdma" at all of them'
        )
        return [*notices, notice]
