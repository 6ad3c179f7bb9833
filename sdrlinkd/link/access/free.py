"""`none`: an air of our own."""

from sdrlinkd.link.access.base import Carriers, Slot, Wish

DEAF_S = 0.02
"""A radio that is deaf for longer than most bursts last is no radio for several without turns."""


class Free(Carriers):
    """Sends whenever there is something to send; `deaf_s`: then it hears nothing for longer."""

    def __init__(self, deaf_s: float = 0.0) -> None:
        super().__init__()
        self._deaf_s = deaf_s

    @property
    def state(self) -> str:
        """For people."""
        return "none"

    def slot(self, wish: Wish) -> Slot | None:
        """At once."""
        return Slot(wish.earliest)

    def notices(self) -> list[str]:
        """Two that are deaf so long lose most of each other's bursts."""
        if self._deaf_s < DEAF_S:
            return []
        notice = (
            "for each burst of its own, this radio hears nothing for "
            f"{self._deaf_s * 1e3:.3g} ms: where other robots send, too, set "
            'access.policy = "tdma" at all of them'
        )
        return [notice]
