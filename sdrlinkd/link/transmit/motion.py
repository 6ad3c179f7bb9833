"""Bounds bursts by how fast the channels to other robots change."""

from collections.abc import Collection
from dataclasses import dataclass
from math import inf, sqrt
from typing import NamedTuple

from sdrlinkd.wire import BROADCAST

TURN = 0.2
"""Longest burst, in periods of the Doppler: the receiver follows a channel for so long, with hardly
a PDU lost."""
WEIGHT = 0.1
"""Weight of the newest burst in the mean square of the Doppler: echoes beat, so bursts differ."""
STALE_S = 3.0
"""Time in s without a burst of a robot after which nothing is known of its channel."""


class Moves(NamedTuple):
    """The Doppler of a robot in Hz, None if unknown; and the longest burst to it in s, None if the
    Doppler sets no bound.
    """

    doppler_hz: float | None = None
    longest_burst_s: float | None = None


@dataclass(slots=True)
class _Channel:
    """The mean square of a robot's Doppler in Hz², and when it was heard last."""

    square: float
    at: float


def longest_burst_s(doppler_hz: float) -> float:
    """The longest burst in s for a channel that changes at `doppler_hz`."""
    return TURN / doppler_hz if doppler_hz > 0 else inf


class Motion:
    """Knows the Doppler of each robot's bursts, which ours have on the way back, too."""

    def __init__(self) -> None:
        self._channels: dict[int, _Channel] = {}

    @property
    def knows_some(self) -> bool:
        """Whether any robot's Doppler was ever told."""
        return bool(self._channels)

    def note(self, src: int, doppler_hz: float, at: float) -> None:
        """Note the Doppler in Hz of a burst of robot `src`."""
        square, known = doppler_hz * doppler_hz, self._channels.get(src)
        if known is None or at - known.at > STALE_S:
            self._channels[src] = _Channel(square, at)
        else:
            known.square += WEIGHT * (square - known.square)
            known.at = at

    def doppler_hz(self, src: int, now: float) -> float | None:
        """The recent Doppler of robot `src` in Hz; None: not known."""
        known = self._channels.get(src)
        return None if known is None or now - known.at > STALE_S else sqrt(known.square)

    def fastest(self, destinations: Collection[int], now: float) -> tuple[float, int]:
        """(Doppler in Hz, robot) of the one of `destinations` whose channel changes the fastest."""
        wanted = self._channels if BROADCAST in destinations else destinations
        return max(((self.doppler_hz(src, now) or 0.0, src) for src in wanted), default=(0.0, 0))

    def longest_s(self, destinations: Collection[int], now: float) -> float:
        """The longest burst in s to `destinations`; to all: as the fastest of them allows."""
        return longest_burst_s(self.fastest(destinations, now)[0])
