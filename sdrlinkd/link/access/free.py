"""`none`: an air of our own."""

from sdrlinkd.link.access.base import Carriers, Slot, Wish


class Free(Carriers):
    """Sends whenever there is something to send."""

    @property
    def state(self) -> str:
        """For people."""
        return "none"

    def slot(self, wish: Wish) -> Slot | None:
        """At once."""
        return Slot(wish.earliest)
