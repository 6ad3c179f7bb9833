"""`none`: the policy for a channel without other robots, or that is not shared."""

from math import inf

from sdrlinkd.link.access.base import BusyChannel, Slot, Wish
from sdrlinkd.link.access.sightings import Sightings

DEAF_S = 0.02
"""Deaf time in s, longer than most bursts, above which several radios need turns."""


class Free(BusyChannel):
    """The policy `none`: send whenever there is something to send.

    `deaf_s` is how long the radio cannot hear around each transmission, beyond the burst itself.
    `gap_s` stays free between two bursts, and `pause_s` after the radio has sent for `tx_window_s`.
    With `is_alone`, no other robot should be on this channel.
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
        """A slot at the requested time."""
        return Slot(wish.earliest)

    def carries(self, burst_s: float) -> float:
        """All airtime except gaps and the listening time between two TX windows."""
        tx_window_s, pause_s = self._tx_windows
        listens = pause_s / (tx_window_s + pause_s) if tx_window_s < inf else 0.0
        gaps = self._gap_s / (burst_s + self._gap_s) if self._gap_s else 0.0
        return (1 - gaps) * (1 - listens)

    def sent(self, end: float, src: int | None) -> None:
        """Ignore our bursts, as nothing depends on when they end."""

    def heard(self, src: int, at: float, is_relayed: bool, *, is_weak: bool = False) -> None:
        """Remember that another robot is on this channel after all."""
        if self._is_alone and not is_relayed:
            self._others.add(src, at)

    def notices(self, now: float) -> list[str]:
        """Warnings about other robots, as radios with a long deaf time miss each other's bursts."""
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
