"""Finds out which topics of other robots consumers here subscribe to."""

from math import inf
from typing import Any

from sdrlinkd.bus import Bus, shown
from sdrlinkd.client import LEAST_RATE_HZ, MOST_RATE_HZ
from sdrlinkd.config import Setup
from sdrlinkd.errors import UserError
from sdrlinkd.link import Link

LEASE_S = 5.0
"""Time in s for which a rate that a consumer asks for holds."""
MOST_ASKED = 1000


class Wanting:
    """Tells the link what the bus's subscriptions mean among the topics that others declare."""

    def __init__(self, setup: Setup, link: Link, bus: Bus) -> None:
        self._setup = setup
        self._link = link
        self._bus = bus
        self._seen: tuple[int, frozenset[bytes], frozenset[tuple[bytes, float]]] = (
            0, frozenset(), frozenset(),
        )  # fmt: skip
        self._asked: dict[tuple[bytes, float], float] = {}
        """Until when a consumer asks for messages of a topic frame in such a period."""
        self._frames: dict[int, tuple[int, list[tuple[bytes, int]]]] = {}
        """By robot: the version of what it declares, and the frame and number of each topic."""

    def ask(self, arguments: dict[str, Any], now: float) -> dict[str, Any]:
        """Note that so many messages a second of a topic are enough for a consumer here; 0: all.

        The fastest of several counts, for LEASE_S each. Raises UserError.
        """
        topic, hz = str(arguments.get("topic", "")), arguments.get("hz")
        if not topic.startswith("/"):
            raise UserError(f"topic: got {shown(topic)!r}; allowed: a topic of another robot")
        if not isinstance(hz, int | float) or not (hz == 0 or LEAST_RATE_HZ <= hz <= MOST_RATE_HZ):
            raise UserError(
                f"hz: got {shown(str(hz))}; allowed: 0 (all), or from {LEAST_RATE_HZ:g} to "
                f"{MOST_RATE_HZ:g}"
            )
        key = topic.encode() + b"\0", 1 / hz if hz else 0.0
        if len(self._asked) >= MOST_ASKED and key not in self._asked:
            raise UserError(f"rates: got one more; allowed: {MOST_ASKED} at a time")
        self._asked[key] = now + LEASE_S
        return {"topic": topic, "hz": hz, "lease_s": LEASE_S}

    @property
    def rated(self) -> list[str]:
        """The topics of which somebody here asks for fewer messages."""
        return sorted({frame[:-1].decode() for frame, period_s in self._asked if period_s})

    def look(self, now: float) -> None:
        """Tell the link, if what is wanted, or declarations, have changed since the last call."""
        # The link's clock may begin anew.
        self._asked = {
            key: until for key, until in self._asked.items() if now < until <= now + LEASE_S
        }
        seen = self._link.heard_version, self._bus.filters, frozenset(self._asked)
        if seen == self._seen:
            return
        self._seen = seen
        enough_s: dict[bytes, float] = {}
        for frame, period_s in self._asked:
            enough_s[frame] = min(period_s, enough_s.get(frame, inf))
        filters = tuple(self._bus.filters)
        # What others declare must not cost more with each change.
        self._frames = {
            src: self._frames_of(src, version)
            for src, version in self._link.heard_versions().items()
        }
        wanted = {
            (src, number): frame
            for src, (_, frames) in self._frames.items()
            for frame, number in frames
            if frame.startswith(filters)
        }
        periods_s = {key: enough_s[frame] for key, frame in wanted.items() if enough_s.get(frame)}
        self._link.want(wanted, periods_s)

    def _frames_of(self, src: int, version: int) -> tuple[int, list[tuple[bytes, int]]]:
        known = self._frames.get(src)
        if known is not None and known[0] == version:
            return known
        topics = self._link.heard_topics_of(src)
        return version, [(self._frame(src, each.name), each.base) for each in topics]

    def _frame(self, src: int, name: str) -> bytes:
        """The topic frame of such messages on the bus."""
        return self._setup.republished(src, name).encode() + b"\0"
