"""Shows those who watch on the bus what is on the air; costs nothing while nobody does."""

import time
from collections.abc import Callable, Sequence
from typing import Any

from sdrlinkd.bus import Bus
from sdrlinkd.link import CLASSES, Burst, Outcome
from sdrlinkd.localtime import at_once
from sdrlinkd.pdulink import AirSeen, BurstSeen, Heard, PduLink
from sdrlinkd.wire import source_and_class

JUMP_NS = 50_000_000
MOST_SOURCES = 1024
"""Bursts whose source is remembered until the modem tells that they are over."""


class AirWatch:
    """Publishes PDUs and bursts, own ones and those heard, with the robot that each is from."""

    def __init__(self, bus: Bus, pdu_link: Callable[[], PduLink]) -> None:
        self._bus = bus
        self._pdu_link = pdu_link
        self._watched: PduLink | None = None
        """The PDU link that has been asked to observe the air."""
        self._offset_ns = 0
        """What is added to a time on the link's clock."""
        self._sources: dict[int, tuple[int, int]] = {}
        """Source and class of the first PDU of each burst, by the burst's start."""

    def look(self) -> None:
        """Begin or end, if the first watcher has come or the last one has gone."""
        wanted = self._pdu_link() if self._bus.is_air_watched else None
        if wanted is self._watched:
            return
        if self._watched is not None:
            self._watched.observe(None)
            self._sources.clear()
        if wanted is not None:
            wanted.observe(self._seen)
        self._watched = wanted

    def heard(self, pdus: Sequence[Heard]) -> None:
        """Take PDUs from the air."""
        if self._bus.is_tapped:
            for pdu in pdus:
                self._bus.tap("rx", pdu.data)
        if self._watched is None:
            return
        for pdu in pdus:
            self._sources.setdefault(_key(pdu.at), source_and_class(pdu.data))
        while len(self._sources) > MOST_SOURCES:
            del self._sources[next(iter(self._sources))]

    def composed(self, burst: Burst | None) -> None:
        """Take a burst that is handed over, if there is one."""
        if burst is not None and self._bus.is_tapped:
            for data in burst.pdus:
                self._bus.tap("tx", data)

    def settled(self, burst: Burst, outcome: Outcome) -> None:
        """Take the outcome of an own burst."""
        if self._watched is None:
            return
        told = {
            "at": self._unix_ns(burst.start),
            "us": round(1e6 * burst.airtime_s),
            "mcs": burst.mcs,
            "n": len(burst.pdus),
            "q": burst.qos.label,
            "end": outcome.value,
        }
        self._bus.tell_air({"own": [told]})

    def _seen(self, seen: AirSeen) -> None:
        self._bus.tell_air(
            {
                "t": self._unix_ns(seen.until),
                "rate": seen.rate_hz,
                "heard": [self._told(each) for each in seen.bursts],
                "mean": seen.mean,
                "peak": seen.peak,
                "pts": seen.points,
                "mod": seen.modulation,
                "bad": seen.n_unreadable,
                "lines": [round(line.offset_hz) for line in seen.lines],
            }
        )

    def _told(self, burst: BurstSeen) -> dict[str, Any]:
        told: dict[str, Any] = {
            "at": self._unix_ns(burst.at),
            "us": round(1e6 * burst.length_s),
            "mcs": burst.mcs,
            "n": burst.n_pdus,
            "ok": burst.n_good,
            "sn": round(burst.snr_db, 1),
            "rs": round(burst.rssi_dbfs, 1),
            "end": burst.ending,
        }
        if (known := self._sources.pop(_key(burst.at), None)) is not None:
            told["s"], told["q"] = known[0], CLASSES[known[1]].label
        return told

    def _unix_ns(self, at: float) -> int:
        """A time on the link's clock in ns since 1970 by this host's clock."""
        now, now_ns = at_once(self._pdu_link().now, time.time_ns)
        offset_ns = now_ns - round(1e9 * now)
        # The clocks' difference as seen varies by some ms, of which bursts would seem to overlap.
        if abs(offset_ns - self._offset_ns) > JUMP_NS:
            self._offset_ns = offset_ns
        return self._offset_ns + round(1e9 * at)


def _key(at: float) -> int:
    """The same for the two ways on which a burst's start comes here."""
    return round(1e6 * at)
