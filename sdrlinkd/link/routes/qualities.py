"""How well other robots are heard: the share of their PDUs that arrives directly."""

from dataclasses import dataclass
from math import exp

from sdrlinkd.link.paths import HALF_BELOW_DB
from sdrlinkd.link.pauses import usual_gap
from sdrlinkd.wire import loss_of

MEMORY_S = 2.0
"""Time constant in s with which PDUs are forgotten."""
PRIOR = 2.0
"""How many PDUs the SNR counts for, as long as few have come."""
DB_PER_HALF = 1.5
"""Change of the SNR in dB that halves, or doubles, the odds that a PDU is lost."""
CLIFF_DB = 0.25
"""Change of the SNR in dB that doubles the odds that a PDU is lost, where half of them are."""
MOST_STEP = 64
"""Most PDUs that one silence counts for."""
FIRST_GAP_S = 1.0
SILENT_GAPS = 3
LEAST_SILENCE_S, MOST_SILENCE_S = 0.2, 10.0
"""A robot is not heard any more after three of its usual gaps, within these limits in s."""
LEAST_PAUSE_S = 1.0
"""If nothing of a robot came by any way for three of its usual gaps, and for so long in s, it or
this robot was away."""
CLEAR_DB = 4.0
"""Least margin of the SNR in dB with which what was missed in a pause says nothing about the link.
A robot at the edge of range comes and goes."""
CHANGED = 4
"""Change of a loss that is told."""


@dataclass(slots=True)
class _Heard:
    newest: int
    at: float
    """When the last PDU of it was noted."""
    direct_at: float
    """When the last PDU came directly."""
    expected: float = 1.0
    arrived: float = 1.0
    gap_s: float = FIRST_GAP_S
    snr_db: float | None = None
    told: int | None = None


class Qualities:
    """The losses of what is heard directly, by robot, in the unit of LSA."""

    def __init__(self) -> None:
        self._heard: dict[int, _Heard] = {}
        self._needed_db = 0.0

    def set_needed_snr(self, needed_db: float) -> None:
        """Set the SNR in dB that the most robust MCS in use needs."""
        self._needed_db = needed_db

    def placed(
        self, src: int, number: int, at: float, snr_db: float | None, *, is_direct: bool
    ) -> None:
        """Note that PDU `number` of a robot came for the first time at `at`, directly or not."""
        heard = self._heard.get(src)
        if heard is None:
            if is_direct:
                self._heard[src] = _Heard(number, at, at, snr_db=snr_db)
            return
        was_away = at - heard.at > max(LEAST_PAUSE_S, _silence_s(heard))
        was_away = was_away and self._is_clear(snr_db if is_direct else heard.snr_db)
        fade = exp(min(0.0, heard.at - at) / MEMORY_S)
        heard.expected *= fade
        heard.arrived *= fade
        heard.at = max(at, heard.at)
        step = number - heard.newest
        if step > 0:
            heard.expected += 1 if was_away else min(step, MOST_STEP)
            heard.newest = number
        if is_direct:
            heard.arrived += 1
            gap_s = min(max(0.0, at - heard.direct_at), MOST_SILENCE_S)
            if gap_s > 0:
                # The PDUs of a burst came together. A single pause is not usual.
                heard.gap_s = usual_gap(min(gap_s, _silence_s(heard)), heard.gap_s)
            heard.direct_at = max(at, heard.direct_at)
            heard.snr_db = snr_db

    def forget(self, src: int) -> None:
        """Begin anew with a robot that has restarted."""
        self._heard.pop(src, None)

    def begin_anew(self) -> None:
        """Go on with another clock."""
        self._heard.clear()

    def hears(self, src: int, now: float) -> bool:
        """Whether a robot is heard directly at `now`."""
        heard = self._heard.get(src)
        if heard is None:
            return False
        return now - heard.direct_at <= _silence_s(heard)

    def losses(self, now: float) -> dict[int, int]:
        """The losses to be told at `now`, by robot; small changes are not told."""
        found = {}
        for src, heard in self._heard.items():
            if not self.hears(src, now):
                heard.told = None
                continue
            loss = self._loss(heard)
            if heard.told is None or abs(loss - heard.told) >= CHANGED:
                heard.told = loss
            found[src] = heard.told
        return found

    def _is_clear(self, snr_db: float | None) -> bool:
        return snr_db is not None and snr_db >= self._needed_db + CLEAR_DB

    def _loss(self, heard: _Heard) -> int:
        usual = most = 1.0
        if heard.snr_db is not None:
            below_db = self._needed_db - heard.snr_db
            usual = 1 / (1 + 2 ** (below_db / DB_PER_HALF))
            # Robots that drive out of range fail suddenly; PDUs tell that too late.
            most = 1 / (1 + 2 ** ((below_db - HALF_BELOW_DB) / CLIFF_DB))
        expected = max(heard.expected, heard.arrived)
        return loss_of(min(most, (heard.arrived + PRIOR * usual) / (expected + PRIOR)))


def _silence_s(heard: _Heard) -> float:
    """The time in s after which a robot is not heard any more."""
    return min(max(SILENT_GAPS * heard.gap_s, LEAST_SILENCE_S), MOST_SILENCE_S)
