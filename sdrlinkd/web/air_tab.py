"""The tab with the air: who sent when, the band, and the points of the last burst."""

import time
from typing import Any

from nicegui.element import Element

from sdrlinkd.colors import COLORS
from sdrlinkd.web.air_log import KEPT_S
from sdrlinkd.web.viewer import Viewer, now_s


class _Air(Element, component="air.js"):
    """The drawing; `show` brings what is new."""


class AirTab:
    """Bursts of the last seconds, spectrum, waterfall and constellation."""

    is_fast = True

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._air = _Air()
        self._air.props["colors"] = [each for each in COLORS if each != "#000000"]
        self._told = self._looks = 0
        """Numbers of the last burst and the last look at the band that are shown."""
        viewer.on_choose.append(self._forget)

    def update(self) -> None:
        """Draw what is new."""
        station, now_ms = self._viewer.station, time.time_ns() / 1e6
        if station is None:
            return
        station.look_at_air(now_s())
        air = station.air
        air.forget_before(now_ms - 1000 * KEPT_S)
        bars = list(air.since(self._told))
        if bars:
            self._told = bars[-1].number
        told: dict[str, Any] = {"now_ms": now_ms, "bars": [each._asdict() for each in bars]}
        if air.n_looks != self._looks:
            self._looks = air.n_looks
            told["band"] = air.band
        self._air.run_method("show", told)

    def _forget(self) -> None:
        self._told = self._looks = 0
        self._air.run_method("clear")
