"""What a policy has in addition to others if each burst tells what comes next (`auction`)."""

from typing import Protocol

from sdrlinkd.link.access.requests import Waiting


class ByAuction(Protocol):
    """The most urgent message of all robots goes next: each burst tells what its robot wants."""

    def told(self, waiting: Waiting | None, start: float) -> None:
        """Note what our burst at `start` tells; None: that we want nothing more."""
